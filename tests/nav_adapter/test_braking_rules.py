"""Braking, driving on and the protective field, against the equations of motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from nav_scenes import ROBOT, robot_at

from nav_adapter import AwarenessPolicy, RobotState
from nav_adapter._contact import contact_m, reach_at
from nav_adapter.limit import (
    course_of,
    in_the_path_mps,
    limit_mps,
    passing_radius_m,
    stops_in_time,
    straight_course_of,
)
from nav_adapter.reach import Reach

SOFT = replace(ROBOT, max_deceleration_mps2=0.7, reaction_time_s=0.4)
TIMES = np.linspace(0.0, 6.0, 1501)


def someone(rng: np.random.Generator) -> Reach:
    return Reach(
        *rng.uniform((-1.5, -1.5), (3.5, 1.5)),
        *rng.uniform(-1.2, 1.2, 2),
        *(rng.uniform(0.0, 0.5), 0.54, 0.1, rng.uniform(0.0, 0.5), 0.4, (0.01, 0.0, 0.0)),
    )


def meets(person: Reach, speed_mps: float, reaction_s: float, turn_rad: float) -> bool:
    """Return whether a robot that brakes after ``reaction_s`` meets the reach while it moves."""
    course = course_of(SOFT, robot_at(speed_mps=speed_mps), turn_rad)
    a = SOFT.max_deceleration_mps2
    for t in TIMES[reaction_s + speed_mps / a > TIMES].tolist():
        braked_s = max(t - reaction_s, 0.0)
        way = speed_mps * t - 0.5 * a * braked_s**2
        near, past, past_behind = contact_m(course, 0.4, *reach_at(person, course, t, t))
        if near <= way <= past or way <= past_behind:
            return True
    return False


def nearer(person: Reach, by_m: float) -> Reach:
    return person._replace(margin_m=person.margin_m - by_m)


@pytest.mark.parametrize("turn_rad", [0.0, 0.3])
def test_braking_suffices_where_no_instant_meets_the_reach(turn_rad: float) -> None:
    rng = np.random.default_rng(4)
    outcomes = []
    for _ in range(150):
        person, speed_mps = someone(rng), rng.uniform(0.2, 1.5)
        course = course_of(SOFT, robot_at(speed_mps=speed_mps), turn_rad)
        met = meets(person, speed_mps, person.elapsed_s, turn_rad)
        outcomes.append(met)
        if met:
            assert not stops_in_time(person, course, speed_mps), person
        else:
            # A little away from the edge of the reach the answer is exact.
            assert stops_in_time(nearer(person, 0.1), course, speed_mps), person
    assert 30 < sum(outcomes) < 120


@pytest.mark.parametrize(
    ("speed_mps", "faster_mps2", "way_m"),
    [(0.5, 1.0, 0.195), (1.45, 1.0, 0.45), (2.0, 1.0, 0.6), (-0.5, 1.0, 0.195), (0.5, 2.0, 0.24)],
)
def test_a_robot_drives_on_while_its_state_ages(
    speed_mps: float, faster_mps2: float, way_m: float
) -> None:
    robot, state = replace(ROBOT, max_acceleration_mps2=faster_mps2), robot_at(speed_mps=speed_mps)
    now, later = (straight_course_of(robot, state, age_s) for age_s in (0.0, 0.3))
    assert later.front_m - now.front_m == pytest.approx(way_m)
    assert later.radius_m - now.radius_m == pytest.approx(way_m)
    assert later.rear_m == now.rear_m


@pytest.mark.parametrize("gap_m", [0.05, 0.4, 1.1])
def test_the_protective_field_is_the_stopping_distance(gap_m: float) -> None:
    course = straight_course_of(SOFT, robot_at(speed_mps=0.5))
    front_m, half_m = course.front_m, course.half_m
    limit = in_the_path_mps((front_m + gap_m + 0.35, 0.0), 0.25, 0.1, course)
    assert limit * 0.4 + limit**2 / (2.0 * 0.7) == pytest.approx(gap_m)
    # A body beside the middle is round, and one beside the field does not count.
    off_m = half_m + 0.1 + 0.15
    assert in_the_path_mps((front_m + gap_m + 0.3, off_m), 0.25, 0.1, course) == pytest.approx(
        limit
    )
    assert in_the_path_mps((front_m, half_m + 0.36), 0.25, 0.1, course) == course.maximum_mps
    assert in_the_path_mps((course.rear_m - 0.26, 0.0), 0.25, 0.1, course) == course.maximum_mps
    assert in_the_path_mps((course.rear_m - 0.24, 0.0), 0.25, 0.1, course) == 0.0
    assert in_the_path_mps((math.nan, 0.0), 0.25, 0.1, course) == 0.0


@pytest.mark.parametrize("yaw_rate_radps", [0.3, -0.8, 2.0, 5.0])
def test_a_footprint_that_turns_stays_within_the_course(yaw_rate_radps: float) -> None:
    robot = replace(ROBOT, drive="differential")
    course = course_of(robot, RobotState(0.0, np.zeros(2), 0.0, 0.6, yaw_rate_radps), 0.0)
    # The heading turns by up to half of the angle until the stop, off the chord.
    turned_rad = 0.5 * min(abs(yaw_rate_radps) * (0.3 + 0.5 * 0.6 / 1.0), math.pi)
    for angle in np.linspace(-turned_rad, turned_rad, 41):
        cos, sin = math.cos(angle), math.sin(angle)
        turned = robot.footprint_m @ np.array([[cos, sin], [-sin, cos]])
        assert turned[:, 0].max() <= course.front_m + 1e-9
        assert turned[:, 0].min() >= course.rear_m - 1e-9
        assert np.abs(turned[:, 1]).max() <= course.half_m + 1e-9
    radius_m = robot.circumscribed_radius_m
    assert max(course.front_m, -course.rear_m, course.half_m) <= radius_m + 1e-9
    straight = straight_course_of(robot, robot_at(speed_mps=0.6))
    assert course.front_m <= straight.front_m + straight.half_m * math.sin(min(turned_rad, 1.5708))


@pytest.mark.parametrize("top_mps", [0.5, 1.5])
def test_beside_the_passing_radius_stands_the_nearest_person_who_lets_the_robot_pass(
    top_mps: float,
) -> None:
    rules = AwarenessPolicy().reach
    assert rules is not None
    course = course_of(ROBOT, robot_at(speed_mps=0.3), math.radians(rules.turn_deg))

    def lowest_mps(radius_m: float) -> float:
        motion = 0.0, 0.0, top_mps, rules.time_constant_s, rules.delay_s
        beside_m = radius_m + course.half_m
        return min(
            limit_mps(Reach(x_m, beside_m, *motion, margin_m=0.4), course)
            for x_m in np.linspace(course.rear_m - radius_m, course.front_m + 3.0 * radius_m, 16)
        )

    radius_m = passing_radius_m(top_mps, rules, 0.1, ROBOT)
    assert lowest_mps(radius_m) >= 0.3
    assert lowest_mps(0.99 * radius_m) < 0.3
