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


@pytest.mark.parametrize("bearing", np.linspace(-math.pi, math.pi, 17))
@pytest.mark.parametrize("turn_deg", [-30.0, -12.0, 0.0, 12.0, 30.0])
def test_nobody_is_reached_by_a_robot_that_turns_while_it_stops(
    bearing: float, turn_deg: float
) -> None:
    for distance in (0.9, 1.2, 1.5, 2.0, 2.5, 3.5):
        for when in (0.0, 0.6):
            _walk_at_a_turning_robot(bearing, distance, math.radians(turn_deg), when)


def _walk_at_a_turning_robot(bearing: float, distance: float, turn: float, when: float) -> None:
    """Simulate small steps: the robot turns as far as allowed, the person sets off straight at it.

    The person has begun to do so before the sensors show it, and follows docs/people.md: the speed
    approaches U = 1.5 m/s with the time constant.
    """
    speed = 1.0
    for _ in range(6):  # find a speed at which the robot obeys its own limit
        speed = min(speed, limit(bearing, distance, speed).speed_limit_mps)
    if speed <= 0.05:
        return
    rules = POLICY.reach
    assert rules is not None
    dt, t, heading = 0.005, 0.0, 0.0
    base, worker = np.zeros(2), distance * np.array([math.cos(bearing), math.sin(bearing)])
    walking_mps, behind = 0.0, False
    for _ in range(round(rules.delay_s / dt)):
        worker, walking_mps = _step(worker, base, walking_mps, dt, rules)
    stop_s = ROBOT.reaction_time_s + speed / ROBOT.max_deceleration_mps2
    start_s, turning_s = when * 0.5 * stop_s, 0.5 * stop_s
    while speed > 0.0:
        # Whoever walks into the back of a robot that turning slows down is faster than it.
        along = np.array([math.cos(heading), math.sin(heading)])
        behind |= bool((worker - base) @ along <= -0.3625)
        if not behind:
            assert _gap_m(base, heading, worker) > POLICY.margins.clearance_m - 0.03
        yaw_rate = 0.0
        if start_s <= t < start_s + turning_s:
            top = speed / ROBOT.circumscribed_radius_m
            yaw_rate = float(np.clip(turn / turning_s, -top, top))
            heading += yaw_rate * dt
        if t >= ROBOT.reaction_time_s:
            speed = max(speed - ROBOT.max_deceleration_mps2 * dt, 0.0)
        # The limit holds for the fastest point, so swinging corners slow the base down.
        forward = speed - abs(yaw_rate) * ROBOT.circumscribed_radius_m
        base = base + max(forward, 0.0) * dt * np.array([math.cos(heading), math.sin(heading)])
        worker, walking_mps = _step(worker, base, walking_mps, dt, rules)
        t += dt


def _step(
    worker: np.ndarray, base: np.ndarray, walking_mps: float, dt: float, rules: ReachRules
) -> tuple[np.ndarray, float]:
    """Return place and speed of a person who walks at the robot, a time step later."""
    towards = base - worker
    walking_mps += (1.5 - walking_mps) * dt / rules.time_constant_s
    return worker + walking_mps * dt * towards / np.linalg.norm(towards), walking_mps


def _gap_m(base: np.ndarray, heading: float, worker: np.ndarray) -> float:
    c, s = math.cos(heading), math.sin(heading)
    x, y = worker - base
    inside = np.abs([c * x + s * y, c * y - s * x]) - [0.3625, 0.25]
    return float(np.linalg.norm(np.maximum(inside, 0.0))) - BODY_RADIUS_M


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
