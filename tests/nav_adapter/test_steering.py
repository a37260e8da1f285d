"""Robots that steer: no curve is tighter than the profile's, whoever asks for it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, finite

from nav_adapter import NavConstraints, NavError, RobotState
from nav_adapter.motion import clip_twists, differential_drive, twist_envelope
from nav_adapter.ros2 import RobotFile

ROUNDING = 1e-9
RADIUS_M = 1.4
STEERS = replace(
    ROBOT,
    footprint_m=np.array([[0.5, 0.5], [-2.1, 0.5], [-2.1, -0.5], [0.5, -0.5]]),
    drive="ackermann",
    max_yaw_rate_radps=0.8,
    max_yaw_acceleration_radps2=2.0,
    min_turning_radius_m=RADIUS_M,
)
DATA: dict[str, Any] = {
    "footprint_m": STEERS.footprint_m.tolist(),
    "max_speed_mps": 1.5,
    "max_acceleration_mps2": 1.0,
    "max_deceleration_mps2": 1.0,
    "reaction_time_s": 0.3,
}


def limited(limit_mps: float, fastest_mps: float | None = None) -> NavConstraints:
    return NavConstraints(
        0.0, (), limit_mps, "a test", False, fastest_point_limit_mps=fastest_mps, robot=STEERS
    )


def tightest_radps(speed: float) -> float:
    return abs(speed) / RADIUS_M


@given(limit_mps=finite(0.0, 1.5), speed=finite(-1.5, 1.5))
def test_the_yaw_limit_is_the_curve_and_the_fastest_point(limit_mps: float, speed: float) -> None:
    alone, among = limited(limit_mps, math.inf), limited(limit_mps)
    assert alone.yaw_rate_limit_radps(speed) == min(tightest_radps(speed), 0.8)
    left = max(0.0, limit_mps - abs(speed)) / STEERS.circumscribed_radius_m
    assert among.yaw_rate_limit_radps(speed) == pytest.approx(min(tightest_radps(speed), left, 0.8))
    assert among.yaw_rate_limit_radps(0.0) == 0.0


@given(limit_mps=finite(0.1, 1.5), v=finite(-2.0, 2.0), w=finite(-1.5, 1.5), backward=st.booleans())
def test_each_cone_of_the_envelope_is_the_twists_of_its_direction(
    limit_mps: float, v: float, w: float, backward: bool
) -> None:
    constraints = limited(limit_mps)
    rows = twist_envelope(constraints, backward=backward)
    assert (rows[:, 2] <= 0.0).all()  # standing is in both
    slack = float((rows[:, :2] @ [v, w] - rows[:, 2]).min())
    within = min(limit_mps - abs(v), constraints.yaw_rate_limit_radps(v) - abs(w))
    way = -v if backward else v
    if min(abs(within), abs(way)) > ROUNDING:
        assert (slack > 0.0) == (within > 0.0 and way > 0.0)


@given(limit_mps=finite(0.0, 1.5), twist=st.tuples(finite(-2, 2), finite(-3, 3)))
def test_clipped_twists_can_be_driven(limit_mps: float, twist: tuple[float, float]) -> None:
    v, w = clip_twists(limited(limit_mps), twist).tolist()
    assert abs(w) <= min(tightest_radps(v), 0.8) + ROUNDING
    assert abs(v) + abs(w) * STEERS.circumscribed_radius_m <= limit_mps + ROUNDING
    assert v * twist[0] >= 0.0
    assert w * twist[1] >= 0.0
    if abs(twist[1]) <= tightest_radps(twist[0]):  # the curve stays
        assert w * twist[0] == pytest.approx(v * twist[1], abs=1e-9)
    else:
        assert abs(w) == pytest.approx(tightest_radps(v), abs=1e-9)
    samples = np.array([[twist, twist], [(1.0, 0.1), twist]])
    np.testing.assert_array_equal(clip_twists(limited(limit_mps), samples)[1, 1], [v, w])


def test_a_robot_that_stands_does_not_turn() -> None:
    np.testing.assert_array_equal(clip_twists(limited(1.0), [0.0, 0.7]), [0.0, 0.0])


@given(
    velocity=st.tuples(finite(-2.0, 2.0), finite(-2.0, 2.0)),
    speed=finite(0.0, 1.5),
    turn=finite(-1.0, 1.0),
    limit_mps=st.none() | finite(0.0, 1.5),
    dt_s=st.none() | finite(0.02, 0.2),
)
def test_a_velocity_becomes_a_curve_that_can_be_driven(
    velocity: tuple[float, float],
    speed: float,
    turn: float,
    limit_mps: float | None,
    dt_s: float | None,
) -> None:
    state = RobotState(0.0, np.zeros(2), 0.0, speed, turn * min(tightest_radps(speed), 0.8))
    constraints = None if limit_mps is None else limited(limit_mps)
    v, w = differential_drive(velocity, state, STEERS, constraints=constraints, dt_s=dt_s)
    assert v >= 0.0
    assert abs(w) <= tightest_radps(v) + ROUNDING
    if dt_s is None and limit_mps is None and math.hypot(*velocity) > 1e-6:
        assert v > 0.0  # also where the velocity leads backward
        assert velocity[1] * w >= 0.0 or velocity[0] < 0.0


@pytest.mark.parametrize(
    "changes",
    [
        {"min_turning_radius_m": None},
        {"drive": "differential"},
        {"drive": None},
        {"min_turning_radius_m": 0.0},
        {"min_turning_radius_m": math.inf},
    ],
)
def test_a_turning_radius_goes_with_steering_alone(changes: dict[str, Any]) -> None:
    with pytest.raises(NavError, match="min_turning_radius_m must"):
        replace(STEERS, **changes)
    assert replace(STEERS, min_turning_radius_m=2).min_turning_radius_m == 2.0
    assert STEERS.moves_sideways is False
    assert ROBOT.moves_sideways is None


def test_the_robot_file_reads_the_kinematics(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    limits = {
        "drive": "ackermann",
        "max_yaw_rate_radps": 0.8,
        "max_yaw_acceleration_radps2": 2.0,
        "min_turning_radius_m": RADIUS_M,
    }
    RobotFile.model_validate(DATA | limits).to_yaml(path)
    profile = RobotFile.from_yaml(path).profile()
    for name, value in limits.items():
        assert getattr(profile, name) == value
    plain = RobotFile.model_validate(DATA).profile()
    assert plain.max_yaw_rate_radps is plain.min_turning_radius_m is None


@pytest.mark.parametrize(
    "wrong",
    [
        {"max_yaw_rate_radps": 0.0},
        {"max_yaw_acceleration_radps2": -1.0},
        {"min_turning_radius_m": 1.0},
        {"drive": "ackermann"},
    ],
)
def test_the_robot_file_refuses_kinematics_that_cannot_be(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"max_yaw|min_turning_radius_m"):
        RobotFile.model_validate(DATA | wrong).profile()
