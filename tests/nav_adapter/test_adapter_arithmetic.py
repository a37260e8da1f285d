"""The adapter's optimisations change no bit of its results, and huge numbers do no harm."""

from __future__ import annotations

import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, finite, numbers, person, robot_at
from shapely import Point

from nav_adapter import AwarenessPolicy, NavAdapter, NavError, PersonObstacle, RobotProfile
from tracking import PersonTrack

FEW = settings(max_examples=30)


@FEW
@given(policy=policies(), robot=robots(), people=crowds(max_size=6), speed=finite(-1.5, 1.5))
def test_unchecked_obstacles_pass_the_checks_of_the_constructor(
    policy: AwarenessPolicy, robot: RobotProfile, people: tuple[PersonTrack, ...], speed: float
) -> None:
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
def test_the_limit_of_a_crowd_is_the_lowest_of_its_people_to_the_bit(
    policy: AwarenessPolicy, robot: RobotProfile, people: tuple[PersonTrack, ...], speed: float
) -> None:
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


@pytest.mark.parametrize(
    "huge",
    [
        person(0.0, velocity=(1e308, 0.0)),
        person(0.0, position=(-1e308, 0.0), velocity=(-1e308, 0.0)),
        person(0.0, position=(1e200, 0.0)),
        person(0.0, sigma_m=1e150),
        replace(person(0.0), covariance_odom=np.eye(4) * 1e308),
        replace(person(0.0), covariance_odom=np.diag([0.01, 0.01, 1e308, 1e308])),
    ],
)
def test_numbers_that_overflow_are_refused_and_change_nothing(huge: PersonTrack) -> None:
    """A track's numbers may be finite while its prediction for 30 s, or its polygon, is not."""
    adapter, other = (NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT) for _ in range(2))
    valid, state = person(0.0, position=(2.0, 0.5)), robot_at(0.0, speed_mps=0.5)
    for each in (adapter, other):
        each.update([valid], state, 0.0)
    with np.errstate(all="ignore"), pytest.raises(NavError, match=r"track 7: .* must be at most"):
        adapter.update([valid, replace(huge, id=7)], robot_at(30.0), 30.0)
    later = person(30.1, position=(2.0, 0.5)), robot_at(30.1)
    assert numbers(adapter.update(later[:1], later[1], 30.1)) == numbers(
        other.update(later[:1], later[1], 30.1)
    )


@pytest.mark.parametrize("preset", ["field", "blind", "conservative", "balanced", "assertive"])
@given(
    exponents=st.tuples(*[st.floats(-8.0, 308.0)] * 4),
    age_s=st.sampled_from([0.0, 0.3, 30.0]),
)
def test_finite_tracks_give_constraints_or_an_error_of_the_package(
    preset: str, exponents: tuple[float, ...], age_s: float
) -> None:
    position_m, speed_mps, variance_m2, variance_m2ps2 = (10.0**each for each in exponents)
    track = replace(
        person(0.0, position=(position_m, 1.0), velocity=(0.0, -speed_mps)),
        covariance_odom=np.diag([variance_m2, variance_m2, variance_m2ps2, variance_m2ps2]),
    )
    policy = AwarenessPolicy(reach=None)
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


@pytest.mark.parametrize("stage", ["obstacles_of", "SpeedBasis", "NavConstraints"])
def test_a_failure_at_any_stage_leaves_the_adapter_as_it_was(
    stage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = AwarenessPolicy.preset("balanced")
    adapter, twin = (NavAdapter(policy, ROBOT) for _ in range(2))
    for step in range(3):
        now, lower = 0.1 * step, 0.4 * step
        people = person(now, position=(2.0, 0.3), awareness_lower=lower)
        for each in (adapter, twin):
            each.update([people], robot_at(now, speed_mps=0.8), now)

    def fail(*args: object, **options: object) -> None:
        raise RuntimeError("by intention")

    with monkeypatch.context() as patch:
        patch.setattr(sys.modules[NavAdapter.__module__], stage, fail)
        with pytest.raises(RuntimeError, match="by intention"):
            adapter.update([person(0.3, track_id=9)], robot_at(0.3), 0.3)
    people = person(0.4, position=(2.0, 0.3), awareness_lower=1.0)
    results = [
        numbers(each.update([people], robot_at(0.4, speed_mps=0.8), 0.4))
        for each in (adapter, twin)
    ]
    assert results[0] == results[1]
