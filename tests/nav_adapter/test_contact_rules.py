"""The meeting of a robot and a reach, against every course of the fan one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nav_adapter.course import Course, contact_m, reach_at
from nav_adapter.limit import in_the_path_mps
from nav_adapter.reach import Reach

GRID = 4001


def some_course(rng: np.random.Generator, fan_rad: float) -> Course:
    angle, front, rear, half = rng.uniform(-3.1, 3.1), *rng.uniform(0.2, 0.6, 3)
    return Course(
        *rng.uniform(-1.0, 1.0, 2),
        *(math.cos(angle), math.sin(angle), math.cos(fan_rad), math.sin(fan_rad)),
        *(front, -rear, half, math.hypot(max(front, rear), half), 0.0),
        *(2.0, 1.0, 0.3),
    )


def one_by_one(
    course: Course, fan_rad: float, margin: float, x: float, y: float, reach: float
) -> tuple[float, float, float]:
    """Return the ways by definition: the footprint is a rectangle on each of many courses."""
    rho, distance = reach + margin, math.hypot(x, y)
    angles = np.linspace(-fan_rad, fan_rad, GRID)
    along = np.cos(angles) * x + np.sin(angles) * y
    beside = np.abs(np.cos(angles) * y - np.sin(angles) * x)
    meets = beside < course.half_m + rho

    def reaches(radius: float, half: float) -> np.ndarray:
        return np.sqrt(np.maximum(radius**2 - np.maximum(beside - half, 0.0) ** 2, 0.0))

    near = (along - course.front_m - reaches(rho, course.half_m))[meets & (along >= 0.0)]
    # A body behind the rear edge does not count, wherever it is across.
    ends = along - course.rear_m + reaches(reach, course.half_m + margin)
    past, behind = ends[meets & (along >= 0.0)], ends[meets & (along < 0.0)]
    if distance > course.radius_m + rho:
        behind = behind[:0]
    if not past.size or past.max() < 0.0:
        return math.inf, -math.inf, behind.max(initial=-math.inf)
    closest = max(near.min(), distance - course.radius_m - rho)
    return closest, past.max(), behind.max(initial=-math.inf)


@pytest.mark.parametrize("fan_rad", [0.0, 0.2, 1.0, 2.2])
def test_ways_are_those_of_all_courses(fan_rad: float) -> None:
    rng = np.random.default_rng(5)
    met = np.zeros(3, dtype=int)
    for _ in range(300):
        course = some_course(rng, fan_rad)
        x, y, reach = rng.uniform(-2.0, 2.5), rng.uniform(0.0, 2.0), rng.uniform(0.0, 0.8)
        found = contact_m(course, x, y, x * x + y * y, reach, 0.3)
        expected = one_by_one(course, fan_rad, 0.3, x, y, reach)
        assert found == pytest.approx(expected, abs=5e-3), (x, y, reach, course)
        # Never later than the first of the courses.
        assert found[0] <= expected[0] + 1e-9
        met += np.isfinite(expected)
    assert met.min() > 30


@pytest.mark.parametrize("fan_rad", [0.0, 0.2, 1.0])
def test_the_protective_field_ends_at_the_first_body_on_any_course(fan_rad: float) -> None:
    rng = np.random.default_rng(6)
    outcomes = []
    for _ in range(300):
        field, age_s = some_course(rng, fan_rad), rng.choice([0.0, 0.2])
        x, y, body_m = rng.uniform(-1.5, 3.0), rng.uniform(-2.0, 2.0), rng.uniform(0.1, 0.5)
        place_m = (
            field.x_m + field.cos * x - field.sin * y,
            field.y_m + field.sin * x + field.cos * y,
        )
        found = in_the_path_mps(place_m, body_m, field, age_s)
        near, past, behind = one_by_one(field, fan_rad, 0.0, x, abs(y), body_m)
        if max(past, behind) == -math.inf:
            expected = field.maximum_mps
        elif behind >= 0.0 or near <= 0.0:
            expected = 0.0
        else:
            # It drives on for the reaction time and the age of the data, and brakes with a = 1.
            speeds = np.linspace(0.0, field.maximum_mps, 20_001)
            way = speeds * (field.reaction_s + age_s) + speeds**2 / 2.0
            expected = speeds[way <= near].max()
        assert found == pytest.approx(expected, abs=0.02), (x, y, body_m, field)
        outcomes.append(found)
    assert {0.0, 2.0} < set(outcomes)


def test_somebody_abreast_of_the_rear_edge_counts() -> None:
    course = some_course(np.random.default_rng(0), 0.0)._replace(rear_m=0.0)
    abreast = contact_m(course, 0.0, 0.4, 0.16, 0.0, 0.3)
    assert abreast == pytest.approx(one_by_one(course, 0.0, 0.3, 0.0, 0.4, 0.0), abs=1e-9)
    assert abreast[1] == 0.0


def test_any_course_leads_straight_to_the_person() -> None:
    course = some_course(np.random.default_rng(0), math.pi)._replace(circle_m=0.5, front_m=0.1)
    assert contact_m(course, 1.2, 1.6, 4.0, 0.4, 0.3) == pytest.approx((0.7, math.inf, -math.inf))
    nowhere = (-math.inf, math.inf, math.inf)
    assert contact_m(course, 0.0, 0.0, 0.0, 0.4, 0.3) == nowhere
    assert contact_m(course, 1.2, 1.6, 4.0, math.nan, 0.3) == nowhere


def test_the_reach_between_two_instants_is_the_later_one_about_the_way_between() -> None:
    rng = np.random.default_rng(1)
    for shrinks in (False, True) * 50:
        course = some_course(rng, 0.2)
        terms = (0.04, -0.02, 0.001) if shrinks else tuple(rng.uniform(0.01, 0.1, 3))
        person = Reach(
            *rng.uniform(-2.0, 2.0, 4),
            *rng.uniform(0.3, 1.6, 1),
            *(0.54, 0.15, rng.uniform(0.0, 0.4), 0.4, rng.uniform(0.0, 0.1), terms),
        )
        t0, t1 = sorted(rng.uniform(0.0, 2.0, 2))
        m0, m1 = person.drift_s(t0), person.drift_s(t1)
        middle = np.array([person.x_m, person.y_m]) - [course.x_m, course.y_m]
        velocity = np.array([person.velocity_x_mps, person.velocity_y_mps])
        middle += 0.5 * (m0 + m1) * velocity
        uncertain = max(person.uncertainty_m(m0), person.uncertainty_m(m1))
        radius = person.radius_m(t1) + 0.5 * (m1 - m0) * np.linalg.norm(velocity) + uncertain
        along = middle @ [course.cos, course.sin]
        across = abs(middle @ [-course.sin, course.cos])
        expected = (along, across, middle @ middle, radius, person.margin_after_m(t1))
        assert reach_at(person, course, t0, t1) == pytest.approx(expected)
