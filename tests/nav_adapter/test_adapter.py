"""The adapter at one time: radii, limits, whom they count, and the arithmetic behind them."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import Own, policies, robots
from nav_scenes import (
    FLOOR_M,
    ROBOT,
    SCANNER,
    crowds,
    finite,
    numbers,
    person,
    policy_radius_m,
    robot_at,
    settled_update,
)
from shapely import Point

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError, PersonObstacle
from nav_adapter.course import course_of
from nav_adapter.limit import limit_mps
from nav_adapter.reach import Reach
from nav_adapter.rigid import Motion
from tracking import PersonTrack


def settled(
    alpha: float,
    *,
    position: tuple[float, float],
    seconds: float = 2.0,
    policy: AwarenessPolicy | None = None,
) -> NavConstraints:
    """Return the constraints after a person with this α has stood in view for a while."""
    adapter = NavAdapter(AwarenessPolicy() if policy is None else policy, ROBOT)
    for step in range(round(seconds / 0.05) + 1):
        now = 0.05 * step
        result = adapter.update(
            (person(now, position=position, awareness_lower=alpha),),
            robot_at(now, speed_mps=0.1),
            now,
        )
    return result


def expected_mps(distance_m: float, human_mps: float, within_m: float = 0.0) -> float:
    """Return the limit for somebody who stands straight ahead, from reach and course alone."""
    rules = AwarenessPolicy().reach
    assert rules is not None
    times = rules.time_constant_s, rules.delay_s
    standing = Reach(distance_m, 0.0, 0.0, 0.0, human_mps, *times, 0.0, FLOOR_M, within_m)
    course = course_of(ROBOT, Motion.of(robot_at(speed_mps=0.1)), math.radians(30.0))
    return min(limit_mps(standing, course), ROBOT.max_speed_mps)


@pytest.mark.parametrize("distance_m", [1.2, 1.6, 2.4])
def test_one_person_straight_ahead(distance_m: float) -> None:
    aware = settled(1.0, position=(distance_m, 0.0))
    (obstacle,) = aware.obstacles
    assert obstacle.radius_m == pytest.approx(policy_radius_m(AwarenessPolicy(), 1.0))
    assert (obstacle.awareness_lower, obstacle.height_m, aware.stale) == (1.0, 1.75, False)
    # What somebody aware does at first lies within the clearance: 0.10 m (1 − 0.23 / 1.5).
    assert aware.speed_limit_mps == pytest.approx(
        expected_mps(distance_m, 0.23, 0.1 * (1.0 - 0.23 / 1.5))
    )
    unaware = settled(0.0, position=(distance_m, 0.0))
    assert unaware.obstacles[0].radius_m == pytest.approx(policy_radius_m(AwarenessPolicy(), 0.0))
    assert unaware.speed_limit_mps == pytest.approx(expected_mps(distance_m, 1.5))
    assert unaware.limited_by == "track 1: reach"
    assert unaware.speed_limit_mps < 0.9 * aware.speed_limit_mps


def test_without_people_the_limit_is_the_robots_maximum() -> None:
    result = NavAdapter(AwarenessPolicy(), ROBOT).update((), robot_at(), 0.0)
    assert result.obstacles == ()
    assert (result.speed_limit_mps, result.limited_by) == (1.5, "robot maximum")
    far = settled(0.0, position=(40.0, 0.0))
    assert (far.speed_limit_mps, far.limited_by) == (1.5, "robot maximum")


@pytest.mark.parametrize("radius", [0.0, -3.0, 0.39, 0.41, 5.0])
def test_the_floor_holds_for_any_policy_object(radius: float) -> None:
    """The floor of the field alone is body and clearance; of reach, the way past the person."""
    for without in ((), SCANNER):
        policy = AwarenessPolicy(inflation=Own(lambda _: radius), without=without)
        adapter = NavAdapter(policy, ROBOT)
        for now in (0.0, 0.5, 1.0, 5.0):
            result = adapter.update((person(now, awareness_lower=1.0),), robot_at(now), now)
            found = result.obstacles[0].radius_m
            assert found >= max(FLOOR_M, radius)
            if without or radius == 5.0:
                assert found == max(FLOOR_M, radius)


def test_a_runner_is_assumed_to_run_on() -> None:
    def limit(velocity: tuple[float, float], alpha: float) -> float:
        return settled_update(
            [person(position=(2.2, 0.0), velocity=velocity, awareness_lower=alpha)]
        ).speed_limit_mps

    for alpha in (0.0, 1.0):
        assert limit((-1.6, 0.0), alpha) < limit((-0.8, 0.0), alpha) < limit((0.0, 0.0), alpha)
    # Whoever has noticed the robot may walk on: 0.3 v + v²/2 + 0.8 (0.3 + v) is the gap of 1.44 m.
    assert 0.75 < limit((-0.8, 0.0), 1.0) <= 0.80
    # Somebody who runs may change to another direction at a run, though not if they are aware.
    assert limit((0.0, 3.0), 0.0) < limit((0.0, 0.0), 0.0)


@settings(max_examples=20)
@given(sigma=finite(0.0, 1.0), x=finite(0.5, 6.0), alpha=st.sampled_from([0.0, 1.0]))
def test_uncertainty_enlarges_the_obstacle_and_lowers_the_limit(sigma, x, alpha) -> None:
    def constraints(sigma_m: float, x_m: float) -> NavConstraints:
        return settled_update([person(position=(x_m, 0.0), sigma_m=sigma_m, awareness_lower=alpha)])

    exact, uncertain = constraints(0.0, x), constraints(sigma, x)
    wider_m = uncertain.obstacles[0].radius_m - exact.obstacles[0].radius_m
    assert wider_m == pytest.approx(2.0 * sigma)
    # Two standard deviations count as much as a body that is nearer by as much.
    nearer = constraints(0.0, max(x - 2.0 * sigma, 0.3))
    assert uncertain.speed_limit_mps <= exact.speed_limit_mps + 1e-9
    if x - 2.0 * sigma > 0.3:
        assert uncertain.speed_limit_mps == pytest.approx(nearer.speed_limit_mps, abs=0.04)


def test_the_protective_field_counts_the_nearer_of_old_and_predicted_place() -> None:
    """A person last seen walking away may have stopped."""
    field = AwarenessPolicy(without=SCANNER)

    def limit(vx: float) -> float:
        track = person(position=(2.0, 0.0), velocity=(vx, 0.0))
        return NavAdapter(field, ROBOT).update((track,), robot_at(0.2), 0.2).speed_limit_mps

    assert limit(1.0) == limit(0.0) > limit(-1.0) > 0.0


def test_the_distance_driven_since_the_robot_state_counts() -> None:
    def limit(speed: float, age: float) -> float:
        adapter = NavAdapter(AwarenessPolicy(), ROBOT)
        return adapter.update(
            (person(1.0),), robot_at(1.0 - age, speed_mps=speed), 1.0
        ).speed_limit_mps

    # A robot that stood then may have set off since.
    # 0.1 s of it are 5 mm.
    assert limit(0.0, 0.3) < limit(0.0, 0.1) <= limit(0.0, 0.0)
    assert limit(1.0, 0.3) < limit(1.0, 0.1) < limit(1.0, 0.0)


FEW = settings(max_examples=20)


@FEW
@given(policy=policies(), robot=robots(), people=crowds(max_size=6), speed=finite(-1.5, 1.5))
def test_unchecked_obstacles_pass_the_checks_of_the_constructor(policy, robot, people, speed):
    constraints = NavAdapter(policy, robot).update(people, robot_at(0.0, speed_mps=speed), 0.0)
    checked = tuple(
        PersonObstacle(**{field.name: getattr(each, field.name) for field in fields(each)})
        for each in constraints.obstacles
    )
    assert numbers(replace(constraints, obstacles=checked)) == numbers(constraints)
    for obstacle in constraints.obstacles:
        assert type(obstacle.radius_m) is type(obstacle.height_m) is float
        for array in (obstacle.center_odom_m, obstacle.velocity_odom_mps):
            assert array.dtype == np.float64
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 1.0


@FEW
@given(policy=policies(), robot=robots(), people=crowds(max_size=6), speed=finite(-1.5, 1.5))
def test_the_limit_of_a_crowd_is_the_lowest_of_its_people_to_the_bit(policy, robot, people, speed):
    state = robot_at(0.0, heading_rad=0.7, speed_mps=speed)

    def limit(some: tuple[PersonTrack, ...]) -> tuple[float, str, bool]:
        result = NavAdapter(policy, robot).update(some, state, 0.0, perception_stamp_s=0.0)
        return result.speed_limit_mps, result.limited_by, result.braking_suffices

    alone = [limit((each,)) for each in sorted(people, key=lambda each: each.id)]
    together = limit(people)
    assert together[0] == min((each[0] for each in alone), default=robot.max_speed_mps)
    assert together[2] == all(each[2] for each in alone)
    if together[0] < robot.max_speed_mps:
        assert together in [(*each[:2], together[2]) for each in alone]


@pytest.mark.parametrize("preset", ["field", "blind", "conservative", "balanced", "assertive"])
@FEW
@given(exponents=st.tuples(*[st.floats(-8.0, 308.0)] * 4), age_s=st.sampled_from([0.0, 0.3, 30.0]))
def test_finite_tracks_give_constraints_or_an_error_of_the_package(preset, exponents, age_s):
    position_m, speed_mps, variance_m2, variance_m2ps2 = (10.0**each for each in exponents)
    track = replace(
        person(0.0, position=(position_m, 1.0), velocity=(0.0, -speed_mps)),
        covariance_odom=np.diag([variance_m2, variance_m2, variance_m2ps2, variance_m2ps2]),
    )
    policy = AwarenessPolicy(without=SCANNER)
    if preset != "field":
        policy = AwarenessPolicy.preset(preset)
    adapter = NavAdapter(policy, ROBOT)
    try:
        constraints = adapter.update([track], robot_at(age_s, speed_mps=1.0), age_s)
    except NavError:
        return
    (obstacle,) = constraints.obstacles
    assert obstacle.polygon.is_valid
    assert obstacle.polygon.contains(Point(obstacle.center_odom_m))
    assert 0.0 <= constraints.speed_limit_mps <= ROBOT.max_speed_mps


POLICY = AwarenessPolicy()


def limit_for(
    bearing_rad: float, distance_m: float, speed_mps: float, policy: AwarenessPolicy = POLICY
) -> NavConstraints:
    position = distance_m * np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    state = robot_at(speed_mps=speed_mps)
    return NavAdapter(policy, ROBOT).update((person(position=position),), state, 0.0)


@FEW
@given(bearing=finite(-math.pi, math.pi), distance=finite(0.5, 4.0))
def test_a_robot_limits_itself_the_way_it_drives(bearing: float, distance: float) -> None:
    """Backwards as forwards: the robot is as long behind as ahead."""
    forward = limit_for(bearing, distance, 1.0).speed_limit_mps
    backward = limit_for(bearing + math.pi, distance, -1.0).speed_limit_mps
    assert backward == pytest.approx(forward, abs=1e-6)
    # A robot that stands starts forwards; another way has a limit of its own.
    slowly = limit_for(bearing, distance, 0.05).speed_limit_mps
    standing = limit_for(bearing, distance, 0.0)
    assert standing.speed_limit_mps == pytest.approx(slowly, abs=1e-6)
    reversing = limit_for(bearing, distance, -0.05)
    reversing_mps = reversing.fastest_point_limit_mps
    assert reversing_mps is not None
    assert standing.other_way_limit_mps <= reversing_mps + 1e-9


@pytest.mark.parametrize("first", [2, 9])
def test_the_limiting_rule_and_person_are_named(first: int) -> None:
    tracks = (
        person(track_id=4, position=(2.2, 0.0), awareness_lower=1.0),
        person(track_id=7, position=(3.5, 0.0)),
        person(track_id=first, position=(1.0, 0.0)),
    )
    driving, field = robot_at(speed_mps=0.3), AwarenessPolicy(without=SCANNER)
    for state, (policy, rule) in product(
        (driving, robot_at()), ((POLICY, "reach"), (field, "in the path"))
    ):
        one, all_three = (
            settled_update(some, policy=policy, state=state) for some in (tracks[:1], tracks)
        )
        assert one.limited_by == f"track 4: {rule}"
        assert all_three.limited_by == f"track {first}: {rule}"
    # Somebody unaware farther away limits more than somebody aware near the robot.
    nearest_unaware = settled_update(
        (
            replace(tracks[0], position_odom_m=np.array([2.6, 0.0])),
            person(track_id=7, position=(2.8, 0.0)),
        ),
        state=driving,
    )
    assert nearest_unaware.limited_by == "track 7: reach"


@FEW
@given(distance=finite(0.0, 6.0), bearing=finite(-math.pi, math.pi), share=finite(0.0, 1.0))
def test_who_obeys_can_always_brake(distance: float, bearing: float, share: float) -> None:
    allowed = limit_for(bearing, distance, 0.0).speed_limit_mps
    assert limit_for(bearing, distance, share * allowed).braking_suffices
