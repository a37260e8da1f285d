"""Twists that contradict the poses of the same odometry, and those that do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from scipy.spatial.transform import Rotation
from test_ros2_bridge import START_S
from test_ros2_odometry import PERIOD_S, OneAhead, Robot, driven, odometry, placed

from nav_adapter.ros2.messages.nav_msgs import Odometry

# As the twist of a robot at this velocity in its own frame, and heading, is published.
WRONG = {
    "in frame 'odom'": lambda v, heading: Rotation.from_euler("z", heading).apply(v),
    "of the wrong sign": lambda v, heading: -v,
    "(nearly) 0": lambda v, heading: 0.0 * v,
    "in cm/s": lambda v, heading: 100.0 * v,
    "in mm/s": lambda v, heading: 1000.0 * v,
    "in km/h": lambda v, heading: 3.6 * v,
}


@pytest.mark.parametrize(("speed", "heading"), [(0.3, 1.5), (0.9, math.pi), (0.2, 1.5)])
@pytest.mark.parametrize("name", WRONG)
def test_a_twist_that_contradicts_the_poses_stops_the_robot(name, speed, heading) -> None:
    if name == "in mm/s":
        speed = 0.09  # above 100 m/s a message is refused
    velocity = np.array([speed, 0.0, 0.0])
    said = WRONG[name](velocity, heading)
    robot = Robot()
    constraints = robot.drive(
        4.0, lambda now: odometry(now, driven(now, speed, 0.0, heading), said)
    )
    stopped = [each for each in constraints if "contradict" in each.limited_by]
    assert stopped
    assert stopped[-1] is constraints[-1]
    assert {each.speed_limit_mps for each in stopped} == {0.0}
    # The cause is known once the robot has moved by 0.7 m in all.
    assert stopped[0].stamp_s - START_S <= 0.7 / speed + 2.0 * PERIOD_S
    assert name in robot.warnings[0]


def test_a_heading_of_180_degrees_with_a_twist_in_odom_is_never_believed() -> None:
    """1.4 m/s towards somebody 3.2 m ahead: 1.15 m/s were allowed instead of 0.81."""
    robot = Robot(make_pipeline=lambda camera: OneAhead(camera, 3.0))
    constraints = robot.drive(
        3.0, lambda now: odometry(now, driven(now, 1.4, 0.0, math.pi), (-1.4, 0.0, 0.0))
    )
    assert {each.speed_limit_mps for each in constraints[4:]} == {0.0}
    assert "'odom' instead of the child frame 'base_link'" in constraints[-1].limited_by


@pytest.mark.parametrize("said", [-0.8, 0.0, math.degrees(0.8)])
def test_yaw_rates_that_contradict_the_poses_stop_the_robot(said: float) -> None:
    robot = Robot()
    constraints = robot.drive(
        3.0,
        lambda now: odometry(now, driven(now, 0.4, 0.8), (0.4, 0.0, 0.0), (0.0, 0.0, said)),
    )
    assert "yaw rates" in constraints[-1].limited_by


@pytest.mark.parametrize("heading", [0.0, 2.5])
@pytest.mark.parametrize("said", [0.0, 0.3])
def test_a_robot_that_stands_is_believed_with_noise_and_spinning_wheels(heading, said) -> None:
    robot, random = Robot(), np.random.default_rng(2)

    def message(now: float) -> Odometry:
        T = placed(*random.normal(0.0, 0.03, 2), heading + random.normal(0.0, 0.02))
        return odometry(now, T, (said, random.normal(0.0, 0.03), 0.0))

    robot.drive(6.0, message)
    assert robot.warnings == []


@pytest.mark.parametrize("yaw_rate", [0.0, 1.2, -1.2])
def test_a_robot_that_speeds_up_slips_and_turns_is_believed(yaw_rate: float) -> None:
    """Wheels that slip by 15 %, a twist that lags by 0.15 s, 1 m/s²."""
    robot, T, speed = Robot(), placed(1.0, 2.0, 2.0), 0.0

    def step(now: float, speed_mps: float) -> None:
        nonlocal T
        T = T @ placed(0.85 * speed_mps * PERIOD_S, 0.0, yaw_rate * PERIOD_S)
        lagging = max(0.0, speed_mps - 0.15)
        robot.step(now, odometry(now, T, (lagging, 0.0, 0.0), (0.0, 0.0, yaw_rate)))

    for tick in range(80):
        speed = min(1.5, speed + PERIOD_S) if tick < 50 else max(0.0, speed - PERIOD_S)
        step(START_S + PERIOD_S * tick, speed)
    assert robot.warnings == []


def test_two_publishers_on_one_topic_stop_the_robot() -> None:
    """The raw odometry and that of a filter, a metre apart, in turns."""
    robot = Robot()
    robot.drive(
        1.0,
        lambda now: odometry(
            now, placed(float(round((now - START_S) / PERIOD_S) % 2)), (0.3, 0, 0)
        ),
    )
    assert robot.standing()
    assert "poses and twists contradict each other" in robot.warnings[0]


def test_a_contradiction_that_comes_again_and_again_holds_longer_each_time() -> None:
    """A robot that obeys sets off after each stop, with a twist that is always 0."""
    robot, x, began = Robot(make_pipeline=lambda camera: OneAhead(camera, 30.0)), 0.0, []
    speed = 0.0
    for tick in range(1200):
        now = START_S + PERIOD_S * tick
        limit = robot.step(now, odometry(now, placed(x))).speed_limit_mps
        if speed == 0.0 < limit:
            began.append(now)
        speed = max(0.0, min(speed + PERIOD_S, limit)) if limit else max(0.0, speed - PERIOD_S)
        x += PERIOD_S * speed
    pauses = np.diff(began)
    assert 3 <= len(pauses) <= 6
    assert (np.diff(pauses) > 1.0).all()
    assert x < 6.0
