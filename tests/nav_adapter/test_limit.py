"""The limit against brute force, in random worlds, and what it may never do."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import nav_scenes
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from limit_worlds import brute_force_mps, run_worlds

from nav_adapter import AwarenessPolicy
from nav_adapter.course import Course, contact_m, course_of, reach_at, starts_of
from nav_adapter.limit import in_the_path_mps, limit_mps, passing_radius_m, stops_in_time
from nav_adapter.reach import Reach
from nav_adapter.rigid import Motion

ROBOT = replace(nav_scenes.ROBOT, drive="differential")
MARGIN_M = 0.40
ANGLES = st.floats(-math.pi, math.pi)
PLACES = st.tuples(st.floats(0.05, 6.0), ANGLES)
WALKS = st.tuples(st.floats(0.0, 1.8), ANGLES)
TURNS = st.floats(0.0, 60.0)


def person(
    place: tuple[float, float], walk: tuple[float, float] = (0.0, 0.0), top: float = 1.5
) -> Reach:
    """Return somebody at a distance and bearing, with a speed and direction."""
    (distance, bearing), (speed, direction) = place, walk
    return Reach(
        *(distance * math.cos(bearing), distance * math.sin(bearing)),
        *(speed * math.cos(direction), speed * math.sin(direction), top, 0.54, 0.15),
        margin_m=MARGIN_M,
    )


def state(
    speed: float = 0.8,
    yaw_rate: float = 0.0,
    *,
    heading: float = 0.0,
    left: float | None = None,
    place: tuple[float, float] = (0.0, 0.0),
) -> Motion:
    return Motion(*place, heading, speed, 0.0 if left is None else left, yaw_rate)


def course(turn_deg: float = 30.0, age_s: float = 0.0, **motion: float) -> Course:
    return course_of(ROBOT, state(**motion), math.radians(turn_deg), age_s)


@pytest.mark.parametrize("seed", range(12))
def test_never_above_brute_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fan = rng.choice([0.0, 0.5, 1.0, 2.0, math.pi])
    at = course(math.degrees(fan))
    reach = person(
        (rng.uniform(0.1, 5.0), rng.uniform(-math.pi, math.pi)),
        (rng.choice([0.0, rng.uniform(0.0, 1.6)]), rng.uniform(-math.pi, math.pi)),
        float(rng.choice([0.0, 0.5, 1.5])),
    )._replace(elapsed_s=float(rng.choice([0.0, 0.1])), variances=(0.01, 0.0, 0.02))
    exact = brute_force_mps(reach, at)
    speeds_mps = at.maximum_mps / 150  # between the speeds that were tried
    assert exact - 0.1 <= limit_mps(reach, at) <= exact + speeds_mps + 1e-9


@pytest.mark.parametrize(
    "worlds", [4_000, pytest.param(1_000_000, marks=pytest.mark.full)], ids=str
)
def test_a_robot_that_obeys_touches_nobody_in_random_worlds(worlds: int) -> None:
    rng = np.random.default_rng(46)
    outcomes = [run_worlds(rng, 500) for _ in range(worlds // 500)]
    assert sum(each.contacts for each in outcomes) == 0
    assert sum(each.moving for each in outcomes) > worlds // 3


@pytest.mark.parametrize("change", [{"speed_factor": 1.3}, {"faster": 1.5}])
def test_worlds_beyond_the_model_have_contacts(change: dict[str, float]) -> None:
    rng = np.random.default_rng(47)
    outcomes = [run_worlds(rng, 500, **change) for _ in range(12)]
    assert sum(each.contacts for each in outcomes) > 0


@given(place=PLACES, walk=WALKS, turn=TURNS, yaw_rate=st.floats(-1.0, 1.0))
def test_whatever_makes_people_or_the_robot_worse_lowers_the_limit(place, walk, turn, yaw_rate):
    reach, at = person(place, walk), course(turn, yaw_rate=yaw_rate)
    limit = limit_mps(reach, at)
    a0, a1, a2 = reach.variances
    worse = [
        reach._replace(speed_mps=1.8),
        reach._replace(delay_s=0.3),
        reach._replace(variances=(a0 + 0.02, a1, a2)),
        reach._replace(variances=(a0, a1, a2 + 0.05)),
        reach._replace(margin_m=MARGIN_M + 0.1),
    ]
    assert all(limit_mps(each, at) <= limit + 1e-9 for each in worse)
    assert limit_mps(reach, at._replace(reaction_s=at.reaction_s + 0.2)) <= limit + 1e-9
    assert limit_mps(reach, course(turn + 10.0, yaw_rate=yaw_rate)) <= limit + 1e-9
    assert limit_mps(reach, course(turn, age_s=0.2, yaw_rate=yaw_rate)) <= limit + 1e-9


@given(place=PLACES, walk=WALKS, turn=TURNS, at_most=st.floats(0.05, 2.0))
def test_a_limit_that_is_asked_for_up_to_a_speed_is_the_same_up_to_it(place, walk, turn, at_most):
    reach, at = person(place, walk), course(turn)
    assert limit_mps(reach, at, at_most) == min(limit_mps(reach, at), at_most)


@given(place=PLACES, turn=TURNS, age=st.floats(0.0, 1.0))
def test_an_older_place_of_somebody_who_stands_lowers_the_limit(place, turn, age) -> None:
    reach, at = person(place), course(turn)
    assert limit_mps(reach._replace(elapsed_s=age), at) <= limit_mps(reach, at) + 1e-9


@given(distance=st.floats(0.5, 5.0), top=st.floats(0.0, 1.5), away=st.floats(0.0, 2.0))
def test_farther_ahead_is_never_slower(distance: float, top: float, away: float) -> None:
    near, far = (person((each, 0.0), top=top) for each in (distance, distance + away))
    assert limit_mps(near, course()) <= limit_mps(far, course()) + 1e-9


@given(place=PLACES, walk=WALKS, turned=ANGLES, yaw_rate=st.floats(-1.0, 1.0))
def test_a_turned_or_mirrored_world_has_the_same_limit(place, walk, turned, yaw_rate) -> None:
    limit = limit_mps(person(place, walk), course(yaw_rate=yaw_rate))
    mirrored = person((place[0], -place[1]), (walk[0], -walk[1]))
    assert limit_mps(mirrored, course(yaw_rate=-yaw_rate)) == pytest.approx(limit, abs=1e-6)
    rotated = person((place[0], place[1] + turned), (walk[0], walk[1] + turned))
    rotated = rotated._replace(x_m=rotated.x_m + 3.0, y_m=rotated.y_m - 2.0)
    at = state(yaw_rate=yaw_rate, heading=turned, place=(3.0, -2.0))
    assert limit_mps(rotated, course_of(ROBOT, at, math.radians(30.0))) == pytest.approx(
        limit, abs=1e-6
    )


def test_time_0_counts_and_a_robot_may_leave_whoever_is_behind_it() -> None:
    inside, touching = person((0.1, 0.3)), person((0.5, 0.0))
    assert limit_mps(inside, course()) == limit_mps(touching, course()) == 0.0
    assert limit_mps(person((0.0, 0.0)), course()) == 0.0
    assert limit_mps(person((0.9, math.pi), top=0.0), course()) == course().maximum_mps
    assert 0.0 < limit_mps(person((0.9, math.pi)), course()) < 1.0  # who may overtake it
    assert limit_mps(person((0.9, 0.0), top=0.0), course(speed=-0.5)) == course().maximum_mps
    assert limit_mps(person((0.9, math.pi), top=0.0), course(speed=-0.5)) < 0.5


@pytest.mark.parametrize("distance_m", [0.9, 1.5, 3.0])
def test_somebody_exactly_ahead_counts_like_somebody_a_hair_beside(distance_m: float) -> None:
    ahead, beside = (person((distance_m, bearing), top=0.0) for bearing in (0.0, 1e-7))
    straight = course(0.0)
    assert limit_mps(ahead, straight) == pytest.approx(limit_mps(beside, straight), abs=1e-6)
    assert limit_mps(ahead, straight) > 0.0


@pytest.mark.parametrize("field", ["x_m", "velocity_y_mps", "speed_mps", "elapsed_s", "delay_s"])
def test_numbers_that_are_not_finite_stop_the_robot(field: str) -> None:
    broken = person((2.0, 0.3))._replace(**{field: math.nan})
    assert limit_mps(broken, course()) == 0.0


@given(place=PLACES, walk=WALKS, speed=st.floats(0.05, 1.5))
def test_a_robot_within_its_limit_stops_in_time(place, walk, speed) -> None:
    reach, at = person(place, walk), course()
    if speed <= limit_mps(reach, at):
        assert stops_in_time(reach, at, speed)


def test_braking_suffices_between_the_limit_and_the_stop() -> None:
    reach = person((2.5, 0.0))
    limit = limit_mps(reach, course())
    assert stops_in_time(reach, course(), limit + 0.05)
    assert not stops_in_time(reach, course(), limit + 0.6)


@given(place=PLACES, left=st.floats(0.15, 1.0), top=st.sampled_from([0.0, 1.5]))
def test_a_robot_that_moves_sideways_looks_where_it_goes(place, left, top) -> None:
    sideways = state(0.0, left=left)
    limit = limit_mps(person(place, top=top), course_of(ROBOT, sideways, 0.5))
    # The same with the robot turned to its course, and its footprint turned back.
    turned = replace(ROBOT, footprint_m=ROBOT.footprint_m[::-1, ::-1])
    ahead = state(left, heading=math.pi / 2)
    assert limit == pytest.approx(
        limit_mps(person(place, top=top), course_of(turned, ahead, 0.5)), abs=1e-6
    )


def test_a_robot_that_may_start_in_any_direction_counts_people_in_all() -> None:
    omni = replace(ROBOT, drive="holonomic")
    at = starts_of(omni, state(0.0), 0.5)
    limits = [limit_mps(person((2.0, bearing)), at) for bearing in (0.0, 1.0, 2.5, math.pi)]
    assert limits == pytest.approx([limits[0]] * 4, abs=1e-6)


def test_a_robot_that_stands_starts_forwards_or_asks_for_another_way() -> None:
    forward, backward = course_of(ROBOT, state(0.0), 0.5), starts_of(ROBOT, state(0.0), 0.5)
    for bearing, course in ((0.0, forward), (math.pi, backward)):
        close, far = person((1.2, bearing), top=0.0), person((4.0, bearing), top=0.0)
        assert limit_mps(close, course) < 0.8
        assert limit_mps(far, course) > 1.5
        assert limit_mps(person((1.2, bearing + math.pi), top=0.0), course) == course.maximum_mps


SOFT = replace(ROBOT, max_deceleration_mps2=0.7, reaction_time_s=0.4)
TIMES = np.linspace(0.0, 6.0, 1501)


def someone(rng: np.random.Generator) -> Reach:
    return Reach(
        *rng.uniform((-1.5, -1.5), (3.5, 1.5)),
        *rng.uniform(-1.2, 1.2, 2),
        *(rng.uniform(0.0, 0.5), 0.54, 0.1, rng.uniform(0.0, 0.5), 0.4),
        *(rng.uniform(0.0, 0.1), (0.01, 0.0, 0.0)),
    )


def meets(reach: Reach, speed_mps: float, reaction_s: float, turn_rad: float) -> bool:
    """Return whether a robot that brakes after ``reaction_s`` meets the reach while it moves."""
    course = course_of(SOFT, state(speed_mps), turn_rad)
    a = SOFT.max_deceleration_mps2
    for t in TIMES[reaction_s + speed_mps / a > TIMES].tolist():
        braked_s = max(t - reaction_s, 0.0)
        way = speed_mps * t - 0.5 * a * braked_s**2
        near, past, past_behind = contact_m(course, *reach_at(reach, course, t, t))
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
        course = course_of(SOFT, state(speed_mps), turn_rad)
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
def test_a_robot_drives_on_while_its_state_ages(speed_mps, faster_mps2, way_m) -> None:
    robot, driving = replace(ROBOT, max_acceleration_mps2=faster_mps2), state(speed_mps)
    now, later = (course_of(robot, driving, 0.0, age_s) for age_s in (0.0, 0.3))
    assert later.front_m - now.front_m == pytest.approx(way_m)
    assert later.radius_m - now.radius_m == pytest.approx(way_m)
    assert later.rear_m == now.rear_m


@pytest.mark.parametrize("gap_m", [0.05, 0.4, 1.1])
def test_the_protective_field_is_the_stopping_distance(gap_m: float) -> None:
    course = course_of(replace(SOFT, drive="differential"), state(0.5), 0.0)
    front_m, half_m, field = course.front_m, course.half_m, course.grown(0.1)
    limit = in_the_path_mps((front_m + gap_m + 0.35, 0.0), 0.25, field)
    assert limit * 0.4 + limit**2 / (2.0 * 0.7) == pytest.approx(gap_m)
    # A body beside the middle is round, and one beside the field does not count.
    off_m = half_m + 0.1 + 0.15
    assert in_the_path_mps((front_m + gap_m + 0.3, off_m), 0.25, field) == pytest.approx(limit)
    assert in_the_path_mps((front_m, half_m + 0.36), 0.25, field) == course.maximum_mps
    assert in_the_path_mps((course.rear_m - 0.26, 0.0), 0.25, field) == course.maximum_mps
    assert in_the_path_mps((course.rear_m - 0.24, 0.0), 0.25, field) == 0.0
    assert in_the_path_mps((math.nan, 0.0), 0.25, field) == 0.0


@pytest.mark.parametrize("yaw_rate_radps", [-6.0, -1.0, 0.0, 3.0])
def test_a_robot_that_may_start_anywhere_has_a_round_protective_field(yaw_rate_radps) -> None:
    omni = replace(ROBOT, drive="holonomic")
    field = starts_of(omni, state(0.0, yaw_rate_radps), 0.0)
    gap_m = 2.0 - omni.circumscribed_radius_m - MARGIN_M
    for bearing in np.linspace(-math.pi, math.pi, 25).tolist():
        place_m = 2.0 * math.cos(bearing), 2.0 * math.sin(bearing)
        limit = in_the_path_mps(place_m, MARGIN_M, field)
        assert limit * 0.3 + limit**2 / 2.0 == pytest.approx(gap_m)


@pytest.mark.parametrize("yaw_rate_radps", [0.3, -0.8, 2.0, 5.0])
def test_a_footprint_that_turns_stays_within_the_course(yaw_rate_radps: float) -> None:
    robot = ROBOT
    course = course_of(robot, state(0.6, yaw_rate_radps), 0.0)
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
    straight = course_of(robot, state(0.6), 0.0)
    assert course.front_m <= straight.front_m + straight.half_m * math.sin(min(turned_rad, 1.5708))


@pytest.mark.parametrize("top_mps", [0.5, 1.5])
def test_beside_the_passing_radius_stands_the_nearest_person_who_lets_the_robot_pass(top_mps):
    rules = AwarenessPolicy().reach
    course = course_of(ROBOT, state(0.3), math.radians(rules.turn_deg))

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


@pytest.mark.parametrize(("top_mps", "brakes_mps2"), [(1e-6, 1.0), (0.01, 10.0)])
def test_a_robot_that_brakes_at_once_takes_no_longer(top_mps: float, brakes_mps2: float) -> None:
    """As many steps as there are in its reaction time, not in the time that it brakes."""
    robot = replace(
        ROBOT, max_speed_mps=top_mps, max_deceleration_mps2=brakes_mps2, reaction_time_s=5.0
    )
    before_s = time.process_time()
    radius_m = passing_radius_m(1.5, AwarenessPolicy().reach, 0.1, robot)
    assert time.process_time() - before_s < 2.0
    assert radius_m > 5.0  # people walk on while it reacts
