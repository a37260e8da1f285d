"""The reference planner lets people who cross its way pass first, early and without a stop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from statistics import mean

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sim_tests import CrossingResult, run_crossing
from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing.planner import PlannerConfig, SamplingPlanner
from sim_tests.crossing.planner._scene import Way, giving_way_mps
from sim_tests.scenario import Scenario

WAY = Way(bearing_rad=0.0, length_m=10.0, half_width_m=0.35, front_m=0.4, rear_m=0.3)
TOP_MPS = 1.5
Person = tuple[float, float, float, float]
PLACE_M = 0.5

people = st.tuples(
    st.floats(-3.0, 12.0), st.floats(-6.0, 6.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)
)
ways = st.builds(
    Way,
    bearing_rad=st.floats(-math.pi, math.pi),
    length_m=st.floats(0.5, 12.0),
    half_width_m=st.floats(0.2, 0.8),
    front_m=st.floats(0.2, 1.5),
    rear_m=st.floats(0.2, 1.5),
)


def _speed_mps(*who: Person, way: Way = WAY) -> float:
    return giving_way_mps(way, who, TOP_MPS, crossing_mps=0.5, within_s=6.0)


def _turned(person: Person, angle_rad: float) -> Person:
    x, y, vx, vy = person
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return c * x - s * y, s * x + c * y, c * vx - s * vy, s * vx + c * vy


@given(person=people, way=ways)
def test_the_front_stays_before_a_person_who_is_in_the_way(person: Person, way: Way) -> None:
    speed_mps = _speed_mps(person, way=way)
    assert 0.0 < speed_mps <= TOP_MPS
    if speed_mps == TOP_MPS:
        return
    x, y, vx, vy = _turned(person, -way.bearing_rad)
    t_s = np.linspace(0.0, 30.0, 6001)
    inside = np.abs(y + vy * t_s) < way.half_width_m + PLACE_M
    front_m = way.front_m + speed_mps * t_s
    assert inside.any()
    assert (front_m <= x + vx * t_s - PLACE_M + 1e-6)[inside].all()


@given(person=people, way=ways, angle_rad=st.floats(-3.0, 3.0))
def test_turned_scenes_give_the_same_speed(person: Person, way: Way, angle_rad: float) -> None:
    turned = replace(way, bearing_rad=way.bearing_rad + angle_rad)
    before = _speed_mps(person, way=way)
    # A person at a bound of a rule may fall on either side of it by rounding.
    x, y, vx, vy = person
    near = [_speed_mps((x + d, y + d, vx + d, vy + d), way=way) for d in (-1e-6, 1e-6)]
    assume(max(abs(speed - before) for speed in near) < 1e-3)
    assert _speed_mps(_turned(person, angle_rad), way=turned) == pytest.approx(before, abs=1e-3)


@given(first=people, second=people)
def test_of_two_people_the_slower_speed_counts(first: Person, second: Person) -> None:
    assert _speed_mps(first, second) == min(_speed_mps(first), _speed_mps(second))


@pytest.mark.parametrize(
    ("person", "why"),
    [
        ((5.0, 3.0, 0.0, 0.4), "slow: may be waiting"),
        ((5.0, -1.5, 0.0, -1.3), "walks away from the way"),
        ((-2.0, 3.0, 0.0, -1.3), "crosses behind the robot"),
        ((5.0, 9.5, 0.0, -1.0), "enters too late"),
        ((2.0, 6.0, 0.0, -1.0), "the robot has long passed"),
        ((12.0, 2.0, 0.0, -1.3), "beyond the goal"),
        ((5.0, 0.2, -1.3, 0.0), "comes head on"),
    ],
)
def test_others_do_not_slow_the_robot(person: Person, why: str) -> None:
    assert _speed_mps(person) == TOP_MPS, why


def test_it_comes_when_the_person_has_left() -> None:
    # Leaves at (3 + 0.35 + 0.5) / 1.3 s, (5 − 0.5 − 0.4) m ahead of the front edge.
    assert _speed_mps((5.0, 3.0, 0.0, -1.3)) == pytest.approx(4.1 / (3.85 / 1.3))


@pytest.mark.parametrize("seeds", [[3012], pytest.param(range(3010, 3022), marks=pytest.mark.full)])
def test_people_who_cross_cost_less_time(seeds: Sequence[int]) -> None:
    """A robot that gives way late makes people hesitate: some crossings then take 5 s more."""
    names = ("crossing_from_left", "group_crossing")
    saved_s = []
    for name in names:
        for seed in seeds:
            usual, without = (_crossing(name, seed, give_way_s) for give_way_s in (6.0, 0.0))
            assert usual.success
            assert not usual.contact
            saved_s.append(without.duration_s - usual.duration_s)
    assert mean(saved_s) > 1.0


def _crossing(name: str, seed: int, give_way_s: float) -> CrossingResult:
    usual = PlannerConfig.for_robot(NOVA_CARTER).model_dump()
    config = PlannerConfig(**{**usual, "give_way_s": give_way_s})
    boxes = Scenario.shipped(name).planner_boxes_odom_m
    planner = SamplingPlanner(NOVA_CARTER, boxes, config)
    return run_crossing(name, policy="balanced", planner=planner, seed=seed)
