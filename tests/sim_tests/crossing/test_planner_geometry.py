"""The mathematics of the planners, against quadrature and exact geometry."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from planner_scenes import HALF_LENGTH_M, HALF_WIDTH_M, OUTLINE_M, ROBOT, coordinate
from scipy.integrate import quad

from sim_tests.crossing.planner._costmap import past_people
from sim_tests.crossing.planner._geometry import (
    Box,
    FootprintBox,
    Poses,
    Rectangles,
    box_gap_m,
    disc_gap_m,
    ramp_integral,
    stopping_integral,
)
from sim_tests.crossing.planner._scene import STANDING, Aim, Disc, Scene


@given(
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(0.1, 3),
    st.one_of(st.just(0.0), st.floats(1e-6, 4)),
)
def test_ramp_integral_is_the_integral_of_a_ramp(v0: float, v1: float, a: float, t: float) -> None:
    def value(s: float) -> float:
        return v0 + math.copysign(min(a * s, abs(v1 - v0)), v1 - v0)

    kink = min(abs(v1 - v0) / a, t)
    exact = quad(value, 0.0, kink)[0] + quad(value, kink, t)[0]
    result = ramp_integral(v0, np.array(v1), a, np.array(t))
    assert float(result) == pytest.approx(exact, abs=1e-9)


@given(st.floats(-2, 2), st.floats(0, 2), st.floats(0, 0.5), st.floats(0, 4))
def test_stopping_integral_is_the_integral_of_a_stop(
    v: float, stop_s: float, hold_s: float, t: float
) -> None:
    def value(s: float) -> float:
        return v if s <= hold_s else v * max(0.0, 1.0 - (s - hold_s) / max(stop_s, 1e-12))

    bounds = [min(bound, t) for bound in (0.0, hold_s, hold_s + stop_s, math.inf)]
    # The rule for quadrature cannot be scaled down to an interval of subnormal length.
    pieces = [pair for pair in pairwise(bounds) if pair[1] - pair[0] > 1e-300]
    exact = sum(quad(value, *pair)[0] for pair in pieces)
    result = stopping_integral(np.array(v), np.array(stop_s), hold_s, np.array(t))
    assert float(result) == pytest.approx(exact, abs=1e-8)


pose_data = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-4, 4))


def rectangle(x: float, y: float, heading: float) -> tuple[Rectangles, shapely.Polygon]:
    c, s = math.cos(heading), math.sin(heading)
    arrays = [np.asarray(value) for value in (x, y, c, s)]
    polygon = shapely.Polygon(OUTLINE_M @ np.array([[c, s], [-s, c]]) + np.array([x, y]))
    return Rectangles(Poses(*arrays), HALF_LENGTH_M, HALF_WIDTH_M), polygon


@given(pose_data, coordinate, coordinate, st.floats(0.1, 1.5))
def test_the_disc_gap_is_the_distance(
    pose: tuple[float, float, float], x: float, y: float, radius: float
) -> None:
    rectangles, polygon = rectangle(*pose)
    gap = disc_gap_m(rectangles, np.asarray(x), np.asarray(y), np.asarray(radius))
    assert float(gap) == pytest.approx(polygon.distance(shapely.Point(x, y)) - radius, abs=1e-9)


@given(pose_data, coordinate, coordinate, st.floats(0.1, 2.0), st.floats(0.1, 2.0))
def test_the_box_gap_is_a_lower_bound_of_the_distance(
    pose: tuple[float, float, float], x: float, y: float, length: float, width: float
) -> None:
    rectangles, polygon = rectangle(*pose)
    box = x, y, x + length, y + width
    assert float(box_gap_m(rectangles, [box])) <= polygon.distance(shapely.box(*box)) + 1e-9


def past(goal: Aim, disc: tuple[float, float, float], boxes: tuple[Box, ...] = ()) -> float:
    """Return the bearing past a disc x, y, radius; the radius includes half the robot's width."""
    x, y, radius = disc
    margin_m = HALF_WIDTH_M + 0.15
    scene = Scene(STANDING, (Disc(x, y, 0.0, 0.0, radius - margin_m),), boxes)
    return past_people(goal, scene, FootprintBox.of(ROBOT)).bearing_rad


@given(st.floats(-3, 3), st.floats(0.5, 5.0), st.floats(-math.pi, math.pi), st.floats(0.2, 2.0))
def test_a_detour_passes_a_disc_in_front_of_the_goal_on_the_nearer_side(
    goal_bearing: float, distance: float, bearing: float, radius: float
) -> None:
    disc = (distance * math.cos(bearing), distance * math.sin(bearing), radius)
    chosen = past(Aim(6.0, goal_bearing), disc)

    def off_disc(angle: float) -> float:
        return abs(math.remainder(angle - bearing, math.tau))

    half_angle = math.asin(min(1.0, radius / distance))
    assume(abs(off_disc(goal_bearing) - half_angle) > 1e-6)
    if off_disc(goal_bearing) > half_angle:
        assert chosen == goal_bearing
    else:
        assert off_disc(chosen) == pytest.approx(half_angle, abs=1e-7)
        turn = abs(math.remainder(chosen - goal_bearing, math.tau))
        assert turn <= half_angle + 0.05 + 1e-7  # up to the preference for the right


def test_a_detour_takes_the_free_side_and_none_if_both_are_blocked() -> None:
    disc, ahead = (3.0, 0.0, 1.0), Aim(6.0, 0.0)
    half_angle = math.asin(1.0 / 3.0)
    right, left = (2.0, -2.0, 4.0, -0.9), (2.0, 0.9, 4.0, 2.0)
    assert past(ahead, disc) == past(ahead, disc, (left,)) == pytest.approx(-half_angle)
    assert past(ahead, disc, (right,)) == pytest.approx(half_angle)
    assert past(ahead, disc, (left, right)) == 0.0
    assert past(Aim(2.5, 0.0), disc) == 0.0  # the goal is nearer
