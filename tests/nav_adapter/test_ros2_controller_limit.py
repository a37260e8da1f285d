"""The limit as Nav2's controllers keep it: per axis, for the base, with turning in proportion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, finite, person, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile
from nav_adapter.ros2 import SLOWEST_MPS, Frames, SpeedMaskSettings, outgoing, speed_limit
from nav_adapter.ros2._speed_mask import SpeedMaskStream

MPPI_RADPS = 1.9


def obeying(sent_mps: float, robot: RobotProfile, share: np.ndarray, yaw_rate: float) -> float:
    """Return the speed of the robot's fastest point under a controller that obeys the message.

    Args:
        sent_mps: the limit in the message.
        robot: its profile.
        share: (2,) in [-1, 1], of the limits of x and y that the controller uses.
        yaw_rate: in [-1, 1], of the controller's largest yaw rate, which it scales.
    """
    velocity = sent_mps * share
    if robot.moves_sideways is False:
        velocity[1] = 0.0
    turn = yaw_rate * (robot.max_yaw_rate_radps or MPPI_RADPS) * sent_mps / robot.max_speed_mps
    if robot.min_turning_radius_m is not None:
        most = abs(velocity[0]) / robot.min_turning_radius_m
        turn = min(max(turn, -most), most)
    x, y = robot.footprint_m.T
    return float(np.hypot(velocity[0] - turn * y, velocity[1] + turn * x).max())


robots = st.builds(
    lambda drive, yaw_rate, offset, speed: replace(
        ROBOT,
        drive=drive,
        max_yaw_rate_radps=yaw_rate,
        footprint_m=ROBOT.footprint_m + np.array([offset, 0.0]),
        max_speed_mps=speed,
        min_turning_radius_m=0.9 if drive == "ackermann" else None,
    ),
    st.sampled_from(["differential", "holonomic", "ackermann", None]),
    st.none() | finite(0.1, 4.0),
    finite(-0.6, 0.6),
    finite(0.3, 2.5),
)
shares = st.sampled_from([-1.0, 0.0, 1.0]) | finite(-1.0, 1.0)


@given(robots, finite(0.02, 3.0), shares, shares, shares, st.booleans())
def test_no_point_is_faster_than_the_limit_under_an_obedient_controller(
    robot: RobotProfile, limit: float, x: float, y: float, yaw_rate: float, percentage: bool
) -> None:
    constraints = NavConstraints(0.0, (), limit, "a test", False, robot=robot)
    message = speed_limit(constraints, robot.max_speed_mps, percentage=percentage)
    sent_mps = message.speed_limit * (robot.max_speed_mps / 100.0 if percentage else 1.0)
    fastest = obeying(sent_mps, robot, np.array([x, y]), yaw_rate)
    assert sent_mps == SLOWEST_MPS or fastest <= limit + 1e-9


@pytest.mark.parametrize(
    ("drive", "factor"),
    [
        ("differential", 1.0 + 1.9 / 1.5 * math.hypot(0.3625, 0.25)),
        ("holonomic", math.sqrt(2.0) + 1.9 / 1.5 * math.hypot(0.3625, 0.25)),
        (None, math.sqrt(2.0) + 1.9 / 1.5 * math.hypot(0.3625, 0.25)),
    ],
)
def test_what_is_sent_is_no_lower_than_it_must_be(drive: str | None, factor: float) -> None:
    """1.56 times the limit at the corner of a differential drive, 1.97 of one that moves aside."""
    robot = replace(ROBOT, drive=drive)
    constraints = NavAdapter(AwarenessPolicy.preset("balanced"), robot).update(
        [person(position=(3.0, 0.0))], robot_at(speed_mps=0.5), 0.0
    )
    assert 0.1 < constraints.speed_limit_mps < 1.4
    messages = dict(outgoing(constraints, (), robot, robot_at(), Frames()))
    sent = messages["speed_limit"].speed_limit
    assert sent == pytest.approx(constraints.speed_limit_mps / factor)
    turned = obeying(sent, robot, np.array([1.0, 1.0]), 1.0)
    assert 0.8 * constraints.speed_limit_mps < turned <= constraints.speed_limit_mps


@pytest.mark.parametrize("drive", ["differential", "holonomic", None])
def test_where_nobody_is_the_robot_keeps_its_own_maximum(drive: str | None) -> None:
    robot = replace(ROBOT, drive=drive)
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), robot)
    constraints = adapter.update([], robot_at(), 0.0)
    assert speed_limit(constraints, 1.5).speed_limit == pytest.approx(0.999 * 1.5)


def test_a_limit_that_is_too_low_to_send_is_a_stop_on_every_topic() -> None:
    robot = replace(ROBOT, drive="holonomic")
    limit = 1.5 * SLOWEST_MPS
    constraints = NavConstraints(0.0, (), limit, "a test", False, robot=robot)
    messages = dict(outgoing(constraints, (), robot, robot_at(), Frames()))
    assert messages["speed_limit"].speed_limit == SLOWEST_MPS
    corners = messages["collision_polygons"].polygon.polygon.points
    assert all(abs(corner.x) < 1.0 for corner in corners)


def test_the_speed_mask_is_for_the_fastest_point_too() -> None:
    masks = {}
    for drive in ("differential", "holonomic"):
        robot = replace(ROBOT, drive=drive)
        adapter = NavAdapter(AwarenessPolicy.preset("balanced"), robot)
        constraints = adapter.update([person(position=(3.0, 0.0))], robot_at(), 0.0)
        stream = SpeedMaskStream(SpeedMaskSettings(size_m=8.0), "odom")
        (_, mask), *_ = (
            each
            for each in stream.messages(constraints, robot_at(), lambda key: True)
            if each[0] == "speed_mask"
        )
        masks[drive] = np.frombuffer(mask.data, np.int8).astype(float)
    limited = masks["differential"] > 10.0
    assert limited.any()
    assert masks["holonomic"][limited] / masks["differential"][limited] == pytest.approx(
        (1.0 + 0.5578) / (math.sqrt(2.0) + 0.5578), abs=0.08
    )
    assert ((masks["holonomic"] == 0.0) == (masks["differential"] == 0.0)).all()
