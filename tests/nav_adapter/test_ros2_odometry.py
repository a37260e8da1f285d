"""Odometry of other frames of the robot, and odometry that contradicts tf, its twists or itself."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from bridge_scenes import INFO, NEEDED, START_S, Listener, Seeing, image, tf
from hypothesis import given, settings
from hypothesis import strategies as st
from scan_scenes import planar
from scipy.spatial.transform import Rotation

from nav_adapter.ros2 import Frames, odometry_problems
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

PERIOD_S = 0.05
HERE = np.eye(4)


def odometry(
    stamp_s: float,
    T: np.ndarray,
    linear=(0.0, 0.0, 0.0),
    angular=(0.0, 0.0, 0.0),
    child: str = "base_link",
) -> Odometry:
    turn = Quaternion(*Rotation.from_matrix(T[:3, :3]).as_quat())
    return Odometry(
        Header(to_time(stamp_s), "odom"),
        child,
        PoseWithCovariance(Pose(Point(*T[:3, 3]), turn)),
        TwistWithCovariance(Twist(Vector3(*linear), Vector3(*angular))),
    )


def unaware(ahead_m: float) -> Seeing:
    """Return perception of an unaware person before the camera of a standing robot."""
    return Seeing(ahead_m, 0.0, 0.01)


class Odometer(Listener):
    """A bridge that gets odometry, tf and images."""

    def __init__(self, **settings) -> None:
        super().__init__(
            **{
                "make_pipeline": lambda camera: unaware(1.8),
                "wanted": NEEDED.__contains__,
                **settings,
            }
        )
        self.bridge.on_camera_info(INFO)

    def step(self, now_s: float, message: Odometry, *transforms: TFMessage):
        for each in transforms:
            self.bridge.on_transforms(each, now_s)
        self.bridge.on_odometry(message, now_s)
        self.bridge.on_image(image(now_s), now_s)
        return self.bridge.tick(now_s)

    def drive(self, seconds: float, message_at, transforms_at=lambda t: (), start_s=START_S):
        """Return the constraints of every tick."""
        times = [start_s + PERIOD_S * tick for tick in range(round(seconds / PERIOD_S))]
        return [self.step(now, message_at(now), *transforms_at(now)) for now in times]


def standing_at(T: np.ndarray, child: str = "base_link", linear=(0.3, 0.0, 0.0)):
    return lambda now: odometry(now, T, linear, child=child)


def on_base(T_base_child: np.ndarray, child: str, linear=(0.3, 0.0, 0.0), angular=(0.0, 0.0, 0.0)):
    """Return the odometry of a frame on a robot whose base is at the origin of odom."""
    R, arm = T_base_child[:3, :3], T_base_child[:3, 3]
    moved = R.T @ (np.array(linear) + np.cross(angular, arm))
    return lambda now: odometry(now, T_base_child, moved, R.T @ np.array(angular), child)


@lru_cache
def reference_limit() -> float:
    (*_, last) = Odometer().drive(2.0, standing_at(HERE))
    assert last.limited_by == "track 1: reach"
    return last.speed_limit_mps


# Optical: x to the right of the robot, y down, z ahead.
OPTICAL = planar(0.3, -0.1, z_m=0.9)
OPTICAL[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


@pytest.mark.parametrize(
    ("child", "T_base_child", "upward"),
    [
        ("rear_axle", planar(-0.8), False),
        ("base_footprint", HERE, True),
        ("camera_aside", planar(0.1, 0.2, yaw_rad=math.pi / 2.0), True),
        ("tracking_camera_optical", OPTICAL, False),
    ],
)
def test_odometry_of_another_frame_is_that_of_the_base(child, T_base_child, upward) -> None:
    robot = Odometer()
    if upward:
        static = tf(child, "base_link", np.linalg.inv(T_base_child))
    else:
        static = tf("base_link", child, T_base_child)
    robot.bridge.on_transforms(static, static=True)
    (*_, last) = robot.drive(2.0, on_base(T_base_child, child))
    assert last.speed_limit_mps == pytest.approx(reference_limit(), abs=0.01)
    state = robot.bridge.robot_state
    assert state.position_odom_m == pytest.approx((0.0, 0.0), abs=1e-9)
    assert state.heading_odom_rad == pytest.approx(0.0, abs=1e-9)
    assert state.velocity_base_mps == pytest.approx((0.3, 0.0), abs=1e-9)
    assert robot.warnings == []


small = st.floats(-2.0, 2.0)


@settings(max_examples=30)
@given(small, small, st.floats(-3.0, 3.0), small, small, st.floats(-1.5, 1.5))
def test_a_twist_is_moved_by_the_lever_arm(x, y, yaw, forward, left, yaw_rate) -> None:
    """The base origin moves as the point of the child's rigid body that it is."""
    T_base_child = planar(x, y, yaw)
    robot = Odometer()
    robot.bridge.on_transforms(tf("base_link", "wheel", T_base_child), static=True)
    message = on_base(T_base_child, "wheel", (forward, left, 0.0), (0.0, 0.0, yaw_rate))
    robot.bridge.on_odometry(message(START_S), START_S)
    state = robot.bridge.robot_state
    assert state.velocity_base_mps == pytest.approx((forward, left), abs=1e-9)
    assert state.yaw_rate_radps == pytest.approx(yaw_rate, abs=1e-9)


@pytest.mark.parametrize("transforms", [(), ("odom",), ("map",)], ids=["none", "odom", "map"])
def test_a_child_frame_that_tf_does_not_know_on_the_robot_stops_it(transforms) -> None:
    """A frame known by way of odom or a map is somebody else's odometry, and no place on it."""
    robot = Odometer()
    for parent in transforms:
        if parent == "map":
            robot.bridge.on_transforms(tf("map", "odom", HERE), START_S)
        robot.bridge.on_transforms(tf("odom", "base_link", HERE), START_S)
    constraints = robot.drive(
        1.0,
        standing_at(planar(-1.0), "base_footprint"),
        lambda now: [tf("odom", "base_link", HERE, now)] if transforms else [],
    )
    assert {each.speed_limit_mps for each in constraints} == {0.0}
    assert robot.standing()
    reason = constraints[-1].limited_by
    for part in ("'base_footprint'", "'base_link'", "static transform", "--base-frame"):
        assert part in reason
    assert len([text for text in robot.warnings if "base_footprint" in text]) == 1


def test_the_base_frame_can_be_the_odometrys_child() -> None:
    robot = Odometer(frames=Frames(base="base_footprint"))
    (*_, last) = robot.drive(2.0, standing_at(HERE, "base_footprint"))
    assert last.speed_limit_mps == pytest.approx(reference_limit())


def test_odometry_waits_for_the_static_transform() -> None:
    robot = Odometer()
    assert robot.drive(1.0, standing_at(planar(-0.8), "rear_axle"))[-1].speed_limit_mps == 0.0
    robot.bridge.on_transforms(tf("rear_axle", "base_link", planar(0.8)), static=True)
    (*_, last) = robot.drive(2.0, standing_at(planar(-0.8), "rear_axle"), start_s=START_S + 1.0)
    assert last.speed_limit_mps == pytest.approx(reference_limit())


@pytest.mark.parametrize(
    ("T_odometry", "T_tf", "text", "lag_s", "chain"),
    [
        (planar(-1.0), HERE, "1.00 m and 0° apart", 0.0, "base_link"),
        (planar(0.0, 0.6), HERE, "0.60 m and 0° apart", -0.03, "base_link"),
        (planar(0.0, yaw_rad=math.radians(60)), HERE, "0.00 m and 60° apart", 0.03, "base_link"),
        (planar(3.0, 1.0, 3.1), planar(3.0, 1.0, -2.6), "apart", 0.03, "base_footprint"),
    ],
)
def test_odometry_that_contradicts_tf_stops_the_robot(T_odometry, T_tf, text, lag_s, chain) -> None:
    robot = Odometer()
    if chain != "base_link":
        robot.bridge.on_transforms(tf(chain, "base_link", HERE), static=True)
    constraints = robot.drive(
        1.0,
        lambda now: odometry(now - max(lag_s, 0.0), T_odometry, child=chain),
        lambda now: [tf("odom", chain, T_tf, now + min(lag_s, 0.0))],
    )
    assert {each.speed_limit_mps for each in constraints[3:]} == {0.0}
    assert text in constraints[-1].limited_by
    assert "odometry and tf contradict each other" in constraints[-1].limited_by
    assert len(robot.warnings) == 1


def driven(now_s: float, speed_mps: float, yaw_rate_radps: float, heading_rad: float = 0.0):
    """Return the pose of a robot that drives a circle from the origin."""
    t = now_s - START_S
    turned = yaw_rate_radps * t
    half = 0.5 * turned
    way_m = speed_mps * t * float(np.sinc(half / np.pi))
    towards = heading_rad + half
    return planar(way_m * math.cos(towards), way_m * math.sin(towards), heading_rad + turned)


@pytest.mark.parametrize(
    ("yaw_rate", "late_s", "every"), [(0.0, 0.0, 1), (1.0, 0.04, 3), (1.0, 0.0, 1)]
)
def test_one_source_in_odometry_and_tf_agrees_at_any_rates(yaw_rate, late_s, every) -> None:
    """Neither rates, nor delays, nor noise of a centimetre, are a contradiction."""
    robot = Odometer()
    random = np.random.default_rng(4)

    def message(now: float) -> Odometry:
        noise = planar(*random.normal(0.0, 0.01, 2), random.normal(0.0, 0.01))
        T = driven(now, 1.4, yaw_rate) @ noise
        return odometry(now, T, (1.4, 0.0, 0.0), (0.0, 0.0, yaw_rate))

    def transforms(now: float):
        if round((now - START_S) / PERIOD_S) % every:
            return []
        return [tf("odom", "base_link", driven(now - late_s, 1.4, yaw_rate), now - late_s)]

    robot.drive(4.0, message, transforms)
    assert robot.warnings == []


def test_a_contradiction_that_ends_is_forgotten_and_the_limit_rises_slowly() -> None:
    robot = Odometer()
    apart = lambda now: [tf("odom", "base_link", HERE, now)]  # noqa: E731
    robot.drive(2.0, standing_at(HERE), apart)
    assert not robot.standing()
    robot.drive(1.0, standing_at(planar(-1.0)), apart, START_S + 2.0)
    assert robot.standing()
    stand = standing_at(HERE, linear=(0.0, 0.0, 0.0))
    constraints = robot.drive(6.0, stand, apart, START_S + 3.0)
    limits = [each.speed_limit_mps for each in constraints]
    assert limits[-1] == pytest.approx(reference_limit(), abs=0.03)
    # From the speed of the robot, by its acceleration over at most the time that counts as fresh.
    assert max(np.diff(limits)) <= 0.25 + 1e-9


def test_the_function_for_recordings_says_the_same_as_the_bridge() -> None:
    times = [START_S + PERIOD_S * tick for tick in range(40)]
    drifted = [odometry(now, planar(-1.0)) for now in times]
    poses = [tf("odom", "base_link", HERE, now) for now in times]
    (problem,) = odometry_problems(drifted, poses)
    assert "odometry and tf contradict each other" in problem
    assert odometry_problems([odometry(now, HERE) for now in times], poses) == ()
    behind = [odometry(now, planar(-0.8), child="rear_axle") for now in times]
    (problem,) = odometry_problems(behind)
    assert "'rear_axle'" in problem
    mounted = [tf("base_link", "rear_axle", planar(-0.8))]
    assert odometry_problems(behind, poses, mounted) == ()
    in_map = [replace(each, header=Header(each.header.stamp, "map")) for each in drifted]
    (problem,) = odometry_problems(in_map, poses)
    assert "must be in frame 'odom'" in problem


def test_a_frame_that_moves_on_the_robot_is_followed_although_its_tf_is_slow() -> None:
    """A message whose time tf does not reach yet is left out, and does not stop the robot."""
    robot = Odometer()

    def lifted(now: float) -> list[TFMessage]:
        tick = round((now - START_S) / PERIOD_S)
        rises = planar(0.1, z_m=0.1 + 1e-4 * tick)
        return [] if tick % 5 else [tf("base_link", "lift", rises, now)]

    constraints = robot.drive(3.0, on_base(planar(0.1, z_m=0.1), "lift"), lifted)
    assert 0.5 * reference_limit() < constraints[-1].speed_limit_mps <= reference_limit()
    assert {each.stale for each in constraints[5:]} == {False}


# As the twist of a robot at this velocity in its own frame, and heading, is published.
WRONG = {
    "in frame 'odom'": lambda v, heading: Rotation.from_euler("z", heading).apply(v),
    "of the wrong sign": lambda v, heading: -v,
    "(nearly) 0": lambda v, heading: 0.0 * v,
    "in cm/s": lambda v, heading: 100.0 * v,
    "in mm/s": lambda v, heading: 1000.0 * v,
    "in km/h": lambda v, heading: 3.6 * v,
}


@pytest.mark.parametrize(("speed", "heading"), [(0.3, 1.5), (0.9, math.pi)])
@pytest.mark.parametrize("name", WRONG)
def test_a_twist_that_contradicts_the_poses_stops_the_robot(name, speed, heading) -> None:
    if name == "in mm/s":
        speed = 0.09  # above 100 m/s a message is refused
    velocity = np.array([speed, 0.0, 0.0])
    said = WRONG[name](velocity, heading)
    robot = Odometer()
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


@pytest.mark.parametrize("said", [-0.8, 0.0, math.degrees(0.8)])
def test_yaw_rates_that_contradict_the_poses_stop_the_robot(said: float) -> None:
    robot = Odometer()
    constraints = robot.drive(
        3.0, lambda now: odometry(now, driven(now, 0.4, 0.8), (0.4, 0.0, 0.0), (0.0, 0.0, said))
    )
    assert "yaw rates" in constraints[-1].limited_by


@pytest.mark.parametrize("heading", [0.0, 2.5])
@pytest.mark.parametrize("said", [0.0, 0.3])
def test_a_robot_that_stands_is_believed_with_noise_and_spinning_wheels(heading, said) -> None:
    robot, random = Odometer(), np.random.default_rng(2)

    def message(now: float) -> Odometry:
        T = planar(*random.normal(0.0, 0.03, 2), heading + random.normal(0.0, 0.02))
        return odometry(now, T, (said, random.normal(0.0, 0.03), 0.0))

    robot.drive(6.0, message)
    assert robot.warnings == []


@pytest.mark.parametrize("yaw_rate", [0.0, 1.2, -1.2])
def test_a_robot_that_speeds_up_slips_and_turns_is_believed(yaw_rate: float) -> None:
    """Wheels that slip by 15 %, a twist that lags by 0.15 s, 1 m/s²."""
    robot, T, speed = Odometer(), planar(1.0, 2.0, 2.0), 0.0

    def step(now: float, speed_mps: float) -> None:
        nonlocal T
        T = T @ planar(0.85 * speed_mps * PERIOD_S, 0.0, yaw_rate * PERIOD_S)
        lagging = max(0.0, speed_mps - 0.15)
        robot.step(now, odometry(now, T, (lagging, 0.0, 0.0), (0.0, 0.0, yaw_rate)))

    for tick in range(80):
        speed = min(1.5, speed + PERIOD_S) if tick < 50 else max(0.0, speed - PERIOD_S)
        step(START_S + PERIOD_S * tick, speed)
    assert robot.warnings == []


def test_two_publishers_on_one_topic_stop_the_robot() -> None:
    """The raw odometry and that of a filter, a metre apart, in turns."""
    robot = Odometer()
    robot.drive(
        1.0,
        lambda now: odometry(
            now, planar(float(round((now - START_S) / PERIOD_S) % 2)), (0.3, 0, 0)
        ),
    )
    assert robot.standing()
    assert "poses and twists contradict each other" in robot.warnings[0]


def test_a_contradiction_that_comes_again_and_again_holds_longer_each_time() -> None:
    """A robot that obeys sets off after each stop, with a twist that is always 0."""
    robot, x, began = Odometer(make_pipeline=lambda camera: unaware(30.0)), 0.0, []
    speed = 0.0
    for tick in range(800):
        now = START_S + PERIOD_S * tick
        limit = robot.step(now, odometry(now, planar(x))).speed_limit_mps
        if speed == 0.0 < limit:
            began.append(now)
        speed = max(0.0, min(speed + PERIOD_S, limit)) if limit else max(0.0, speed - PERIOD_S)
        x += PERIOD_S * speed
    pauses = np.diff(began)
    assert len(pauses) == 3
    assert (np.diff(pauses) > 1.0).all()
    assert x < 6.0
