"""The people who limit the speed: all whom the robot can reach while it stops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from nav_scenes import ROBOT, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.policies import ReachRules
from perception.anthropometry import BODY_RADIUS_M

POLICY = AwarenessPolicy()


def limit(
    bearing_rad: float, distance_m: float, speed_mps: float, policy: AwarenessPolicy = POLICY
) -> NavConstraints:
    position = distance_m * np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    state = robot_at(speed_mps=speed_mps)
    return NavAdapter(policy, ROBOT).update((person(position=position),), state, 0.0)


def test_a_person_behind_a_moving_robot_limits_it_less_than_one_ahead() -> None:
    """Only somebody who is faster than the robot reaches it from behind."""
    ahead, behind = limit(0.0, 1.5, 1.0), limit(math.pi, 1.5, 1.0)
    assert behind.speed_limit_mps > ahead.speed_limit_mps
    assert ahead.limited_by == "track 1: reach"
    assert limit(math.pi, 5.0, 1.0).limited_by == "robot maximum"
    # Somebody at the rear edge does reach a robot that stops.
    assert limit(math.pi, 0.7, 1.0).speed_limit_mps < ROBOT.max_speed_mps


@given(bearing=finite(-math.pi, math.pi), distance=finite(0.5, 4.0))
def test_a_robot_limits_itself_the_way_it_drives(bearing: float, distance: float) -> None:
    """Backwards as forwards: the robot is as long behind as ahead."""
    forward = limit(bearing, distance, 1.0).speed_limit_mps
    backward = limit(bearing + math.pi, distance, -1.0).speed_limit_mps
    assert backward == pytest.approx(forward, abs=1e-6)
    # A robot that stands may start either way.
    standing = limit(bearing, distance, 0.0).speed_limit_mps
    reversing = limit(bearing, distance, -1.0).speed_limit_mps
    assert standing <= min(forward, reversing) + 0.02


@given(bearing=finite(-math.pi, math.pi), distance=finite(0.5, 4.0), speed=finite(0.1, 1.5))
def test_a_wider_turn_never_allows_more(bearing: float, distance: float, speed: float) -> None:
    limits = [
        limit(
            bearing,
            distance,
            speed,
            POLICY.model_copy(update={"reach": ReachRules(turn_deg=turn_deg)}),
        ).speed_limit_mps
        for turn_deg in (0.0, 30.0, 90.0, 180.0)
    ]
    assert (np.diff(limits) <= 1e-9).all()


def test_the_limiting_rule_and_person_are_named() -> None:
    tracks = (
        person(track_id=4, position=(2.2, 0.0), awareness_lower=1.0),
        person(track_id=7, position=(3.5, 0.0)),
        person(track_id=9, position=(1.0, 0.0)),
    )
    driving = robot_at(speed_mps=0.3)
    field = AwarenessPolicy(reach=None)
    for policy, rule in ((POLICY, "reach"), (field, "in the path")):
        assert settled_update(tracks[:1], policy=policy, state=driving).limited_by == (
            f"track 4: {rule}"
        )
        assert settled_update(tracks, policy=policy, state=driving).limited_by == (
            f"track 9: {rule}"
        )
    # Somebody unaware farther away limits more than somebody aware near the robot.
    nearest_unaware = settled_update(
        (
            replace(tracks[0], position_odom_m=np.array([2.6, 0.0])),
            person(track_id=7, position=(2.8, 0.0)),
        ),
        state=driving,
    )
    assert nearest_unaware.limited_by == "track 7: reach"


@pytest.mark.parametrize(("speed", "suffices"), [(0.3, True), (0.6, True), (1.4, False)])
def test_braking_suffices_is_false_when_the_robot_is_too_fast(speed: float, suffices: bool) -> None:
    """1.2 m of way; from 1.4 m/s full braking takes 0.98 m, and the person comes 0.94 m."""
    result = limit(0.0, 1.2 + 0.3625 + BODY_RADIUS_M + 0.1, speed)
    assert result.braking_suffices is suffices
    rules = POLICY.reach
    assert rules is not None
    since_s, tau = speed / 1.0 + rules.delay_s, rules.time_constant_s
    walked_m = 1.5 * (since_s + tau * math.expm1(-since_s / tau))
    # At the moment when it stands; before, it is nearer to where it was.
    assert (speed**2 / 2.0 + walked_m < 1.2) is suffices


@given(distance=finite(0.0, 6.0), bearing=finite(-math.pi, math.pi), share=finite(0.0, 1.0))
def test_who_obeys_can_always_brake(distance: float, bearing: float, share: float) -> None:
    allowed = limit(bearing, distance, 0.0).speed_limit_mps
    assert limit(bearing, distance, share * allowed).braking_suffices
