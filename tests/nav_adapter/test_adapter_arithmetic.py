"""The adapter's optimisations change no bit of its results."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, finite, numbers, person, robot_at

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
    ],
)
def test_numbers_that_overflow_are_refused_and_change_nothing(huge: PersonTrack) -> None:
    """A track's numbers may be finite while its prediction for 30 s is not."""
    adapter, other = (NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT) for _ in range(2))
    valid, state = person(0.0, position=(2.0, 0.5)), robot_at(0.0, speed_mps=0.5)
    for each in (adapter, other):
        each.update([valid], state, 0.0)
    with np.errstate(all="ignore"), pytest.raises(NavError, match="must be finite"):
        adapter.update([valid, replace(huge, id=7)], robot_at(30.0), 30.0)
    later = person(30.1, position=(2.0, 0.5)), robot_at(30.1)
    assert numbers(adapter.update(later[:1], later[1], 30.1)) == numbers(
        other.update(later[:1], later[1], 30.1)
    )
