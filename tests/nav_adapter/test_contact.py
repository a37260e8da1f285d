"""Contact of the robot with a reach: corners that swing out, noise, and the way to a stop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from nav_scenes import ROBOT, robot_at

from nav_adapter import RobotState
from nav_adapter.limit import course_of, limit_mps, stops_in_time, straight_course_of
from nav_adapter.reach import Reach

FRONT_M = float(ROBOT.footprint_m[:, 0].max())
MARGIN_M = 0.3


def standing(x_m: float, variances: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Reach:
    """Return the reach of somebody who stays where they are, ahead of the robot."""
    return Reach(x_m, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, margin_m=MARGIN_M, variances=variances)


def turning(rate_radps: float) -> RobotState:
    return RobotState(0.0, np.zeros(2), 0.0, 0.5, rate_radps)


def test_a_corner_that_swings_past_the_side_counts_at_its_farthest() -> None:
    halves = [course_of(ROBOT, turning(rate), 0.0).half_m for rate in np.linspace(0.0, 8.0, 41)]
    assert np.diff(halves).min() >= 0.0
    assert halves[-1] == pytest.approx(ROBOT.circumscribed_radius_m)


def test_no_turn_makes_the_robot_larger_than_its_circle() -> None:
    radius_m = ROBOT.circumscribed_radius_m
    for rate_radps in (2.0, 4.0, 8.0):
        course = course_of(ROBOT, turning(rate_radps), math.pi)
        for angle in np.linspace(0.0, math.pi, 13).tolist():
            away_m = radius_m + MARGIN_M + 0.05
            place = {"x_m": away_m * math.cos(angle), "y_m": away_m * math.sin(angle)}
            assert limit_mps(standing(0.0)._replace(**place), course) > 0.0


def test_a_place_that_becomes_more_certain_counts_as_it_is_now() -> None:
    course = straight_course_of(ROBOT, robot_at(speed_mps=0.5))
    gap_m = 0.25
    assert limit_mps(standing(FRONT_M + MARGIN_M + gap_m, (0.09, -9.0, 0.0)), course) == 0.0
    assert limit_mps(standing(FRONT_M + MARGIN_M + gap_m, (0.04, -9.0, 0.0)), course) > 0.0


@pytest.mark.parametrize("speed_mps", [0.55, 0.6, 0.81, 1.07])
def test_a_robot_that_brakes_goes_as_far_as_its_stop(speed_mps: float) -> None:
    course = straight_course_of(ROBOT, robot_at(speed_mps=speed_mps))
    way_m = 0.5 * speed_mps**2 / ROBOT.max_deceleration_mps2
    at_m = FRONT_M + MARGIN_M + way_m
    assert not stops_in_time(standing(at_m - 1e-4), course, speed_mps)
    assert stops_in_time(standing(at_m + 1e-4), course, speed_mps)
