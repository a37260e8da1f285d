"""Robots that cannot be: sizes, speeds and mounts in another unit, and booleans for numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nav_adapter import NavError, RobotProfile
from perception import PerceptionError
from perception.arrays import finite_number
from sim_tests.actors.robot import RobotModel, shipped_robots
from tracking import TrackerConfig, TrackingError

OUTLINE_M = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
LIMITS = {
    "max_speed_mps": 1.5,
    "max_acceleration_mps2": 1.0,
    "max_deceleration_mps2": 1.0,
    "reaction_time_s": 0.3,
}


@pytest.mark.parametrize(
    ("factor", "text"),
    [
        (1000.0, "within 10 m of the base origin, got a corner at 438.292 m; .*millimetres"),
        (100.0, "within 10 m of the base origin, got a corner at 43.8292 m; .*centimetres"),
        (39.37, "within 10 m of the base origin"),
        (0.01, "at least 0.002 m², got 3.6e-05 m²; its corners are in metres"),
        ([1.0, 0.001], "at least 0.002 m², got 0.00036 m²"),
    ],
)
def test_a_footprint_in_another_unit_is_refused(factor: object, text: str) -> None:
    with pytest.raises(NavError, match=f"^footprint_m must .*{text}"):
        RobotProfile(OUTLINE_M * factor, **LIMITS)


def test_a_footprint_that_lies_elsewhere_is_refused() -> None:
    """As one in the frame of a map does."""
    with pytest.raises(NavError, match="within 10 m of the base origin"):
        RobotProfile(OUTLINE_M + np.array([12.0, 40.0]), **LIMITS)


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("max_speed_mps", 150.0, "at most 15 m/s, got 150 m/s; is it in mm/s, cm/s or km/h"),
        ("max_acceleration_mps2", 100.0, "at most 10 m/s², got 100 m/s²"),
        ("max_deceleration_mps2", 1000.0, "at most 10 m/s², got 1000 m/s²; is it in mm/s²"),
        ("reaction_time_s", 300.0, "at most 5 s, got 300 s; is it in milliseconds"),
        ("max_yaw_rate_radps", 90.0, "at most 20 rad/s, got 90 rad/s; is it in degrees per second"),
        ("max_yaw_acceleration_radps2", 180.0, "at most 100 rad/s², got 180 rad/s²"),
    ],
)
def test_limits_in_another_unit_are_refused_with_both_units(
    name: str, value: float, text: str
) -> None:
    with pytest.raises(NavError, match=f"^{name} must be {text}"):
        RobotProfile(OUTLINE_M, **{**LIMITS, name: value})


def test_a_turning_radius_in_millimetres_is_refused() -> None:
    steers = {"drive": "ackermann", "min_turning_radius_m": 1500.0}
    with pytest.raises(NavError, match="at most 100 m, got 1500 m; is it in millimetres"):
        RobotProfile(OUTLINE_M, **LIMITS, **steers)


def test_small_large_and_shipped_robots_are_within_the_bounds() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    e_puck_m = 0.035 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert RobotProfile(e_puck_m, 0.15, 1.0, 1.0, 0.0).reaction_time_s == 0.0
    assert RobotProfile(OUTLINE_M * 12.0, 3.0, 2.0, 8.0, 1.0).max_deceleration_mps2 == 8.0
    for name in shipped_robots():
        assert RobotModel.shipped(name).profile.max_speed_mps <= 5.0


def test_a_boolean_is_no_number_anywhere(tmp_path: Path) -> None:
    for value in (True, np.False_):
        with pytest.raises(PerceptionError, match="x must be a number, got bool"):
            finite_number("x", value)
        with pytest.raises(NavError, match="reaction_time_s must be a number"):
            RobotProfile(OUTLINE_M, **{**LIMITS, "reaction_time_s": value})
    (tmp_path / "tracker.yaml").write_text("awareness: {memory_s: no}\n")
    with pytest.raises(TrackingError, match="awareness: memory_s must be a number, got False"):
        TrackerConfig.from_yaml(tmp_path / "tracker.yaml")
