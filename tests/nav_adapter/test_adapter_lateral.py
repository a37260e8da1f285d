"""Robots that move sideways: the velocity is a vector in the base frame."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from nav_scenes import ROBOT, crowds, finite, moved_robot, person, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from nav_adapter.limit import FINEST, STEPS
from nav_adapter.policies import AlertRules
from tracking import PersonTrack

# A round robot has no front: only its velocity tells where it goes.
CIRCLE = np.array([[math.cos(k * math.pi / 32), math.sin(k * math.pi / 32)] for k in range(64)])
ROUND = replace(ROBOT, footprint_m=0.35 * CIRCLE, drive="holonomic")


def moving(forward: float, left: float, *, heading: float = 0.0, age_s: float = 0.0) -> RobotState:
    return RobotState(-age_s, np.zeros(2), heading, forward, 0.0, np.array([forward, left]))


def constraints(
    state: RobotState, *tracks: PersonTrack, robot: RobotProfile = ROUND
) -> NavConstraints:
    return NavAdapter(AwarenessPolicy(), robot).update(tracks, state, 0.0)


def test_a_robot_that_moves_sideways_may_be_too_fast_for_somebody_beside_it() -> None:
    state, close = moving(0.0, 1.2, age_s=0.2), person(position=(0.0, 1.2))
    assert not constraints(state, close).braking_suffices
    assert constraints(replace(state, velocity_base_mps=None), close).braking_suffices
    assert constraints(state, close).reachable_speed_limit_mps == 1.2


@given(people=crowds(), speed=finite(0.11, 2.0), course=finite(-3.1, 3.1), age=finite(0.0, 0.4))
def test_only_the_direction_of_travel_counts_for_a_round_robot(people, speed, course, age) -> None:
    """Sideways with one heading equals straight ahead with another."""
    forward, left = speed * math.cos(course), speed * math.sin(course)
    if abs(left) <= 0.1:
        return
    sideways = constraints(moving(forward, left, age_s=age), *people)
    straight = constraints(moving(speed, 0.0, heading=course, age_s=age), *people)
    # The corners of the polygon with 64 sides lie up to 0.4 mm off the circle, and a limit at which
    # the robot comes to a stand has steps.
    slack_mps = 5e-3 + FINEST * ROUND.max_speed_mps / STEPS
    assert sideways.speed_limit_mps == pytest.approx(straight.speed_limit_mps, abs=slack_mps)
    assert sideways.reachable_speed_limit_mps == pytest.approx(
        straight.reachable_speed_limit_mps, abs=slack_mps
    )


@pytest.mark.parametrize(
    "changes", [{"drive": "differential"}, {"drive": "ackermann", "min_turning_radius_m": 1.5}]
)
def test_a_robot_that_cannot_move_sideways_but_does_is_stopped_loudly(changes, caplog) -> None:
    adapter = NavAdapter(AwarenessPolicy(), replace(ROBOT, **changes))
    with caplog.at_level(logging.WARNING, logger="nav_adapter"):
        for k in range(5):
            state = replace(moving(0.0, -1.2), stamp_s=0.1 * k)
            result = adapter.update((), state, 0.1 * k)
            assert result.speed_limit_mps == 0.0
            assert "moves sideways at 1.20 m/s" in result.limited_by
            assert f"drive='{changes['drive']}'" in result.limited_by
    assert len(caplog.records) == 1
    quiet = adapter.update((), replace(moving(0.5, 0.09), stamp_s=0.6), 0.6)
    assert "sideways" not in quiet.limited_by
    assert quiet.speed_limit_mps > 0.0


@pytest.mark.parametrize("drive", ["holonomic", None])
def test_other_robots_may_move_sideways(drive: str | None) -> None:
    result = constraints(moving(0.0, 1.2), robot=replace(ROBOT, drive=drive))
    assert result.speed_limit_mps == ROBOT.max_speed_mps


def test_without_a_vector_the_robot_moves_straight() -> None:
    state = robot_at(heading_rad=0.7, speed_mps=-0.4)
    assert state.velocity_base_mps is None
    assert state.lateral_mps == 0.0
    assert state.travel_mps == 0.4
    assert state.velocity_odom_mps == pytest.approx((-0.4 * math.cos(0.7), -0.4 * math.sin(0.7)))
    assert replace(state, speed_mps=1.0).travel_mps == 1.0
    turned = moved_robot(moving(0.3, 0.4), math.pi / 2.0, np.zeros(2))
    assert turned.velocity_odom_mps == pytest.approx((-0.4, 0.3))


def test_people_beside_a_robot_that_moves_sideways_are_warned() -> None:
    policy = AwarenessPolicy(alerts=AlertRules())
    for left, warned in ((1.0, True), (-1.0, False), (0.0, False)):
        result = NavAdapter(policy, ROUND).update(
            (person(position=(0.0, 3.0)),), moving(0.0, left), 0.0
        )
        assert bool(result.alerts) is warned


def test_noise_to_the_side_never_raises_the_limit_of_a_robot_that_can_move_sideways() -> None:
    def limit(lateral_mps: float) -> float:
        state = replace(robot_at(speed_mps=0.051), velocity_base_mps=np.array([0.051, lateral_mps]))
        behind = person(position=(-2.0, 0.35))
        return NavAdapter(AwarenessPolicy(), ROBOT).update([behind], state, 0.0).speed_limit_mps

    # Up to 0.1 m/s counts as noise.
    assert limit(0.0999) == pytest.approx(limit(0.1), abs=1e-3)
    assert limit(0.1) <= limit(0.1001) + 1e-3
