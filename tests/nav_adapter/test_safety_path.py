"""The people who limit the speed: all whom the robot can reach while it stops."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from nav_scenes import ROBOT, finite, person, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.policies import DistanceZones, NearCap, SpeedRules
from perception.anthropometry import BODY_RADIUS_M

POLICY = AwarenessPolicy()


def limit(
    bearing_rad: float, distance_m: float, speed_mps: float, policy: AwarenessPolicy = POLICY
) -> NavConstraints:
    position = distance_m * np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    state = robot_at(speed_mps=speed_mps)
    return NavAdapter(policy, ROBOT).update((person(position=position),), state, 0.0)


def test_a_person_behind_a_moving_robot_limits_it_less_than_one_ahead() -> None:
    ahead, behind = limit(0.0, 2.5, 1.0), limit(math.pi, 2.5, 1.0)
    assert behind.speed_limit_mps > ahead.speed_limit_mps
    # There still is a limit: the person could walk into the robot while it stops.
    assert behind.limited_by == "track 1: speed and separation"
    reach_m = ROBOT.circumscribed_radius_m
    spare_m = 2.5 - BODY_RADIUS_M - reach_m - POLICY.margins.separation_clearance_m
    assert behind.speed_limit_mps == pytest.approx(spare_m / 1.6 - ROBOT.reaction_time_s)
    assert limit(math.pi, 5.0, 1.0).limited_by == "robot maximum"


@given(bearing=finite(-math.pi, math.pi), distance=finite(0.5, 6.0))
def test_people_limit_less_only_outside_the_turn_and_only_while_moving(
    bearing: float, distance: float
) -> None:
    """A standing robot may start in any direction; a reversing one drives backward."""
    here = np.array([math.cos(bearing), math.sin(bearing)]) * distance
    everyone = POLICY.model_copy(update={"rules": SpeedRules(turn_within_stop_deg=180.0)})
    for speed in (1.0, -1.0, 0.0):
        relieved, full = limit(bearing, distance, speed), limit(bearing, distance, speed, everyone)
        assert relieved.speed_limit_mps >= full.speed_limit_mps
        in_front = speed == 0.0 or speed * here[0] >= 0.0
        if in_front:
            assert relieved.speed_limit_mps == full.speed_limit_mps


@pytest.mark.parametrize("bearing", np.linspace(-math.pi, math.pi, 17))
@pytest.mark.parametrize("turn", [-1.5, -0.7, 0.0, 0.7, 1.5])
def test_nobody_is_reached_by_a_robot_that_turns_while_it_stops(
    bearing: float, turn: float
) -> None:
    """The limit for people beside and behind is never above what the motion allows."""
    for distance in (1.5, 2.0, 2.5, 3.0, 3.5, 4.5):
        for when in (0.0, 0.6):
            _walk_at_a_turning_robot(bearing, distance, turn, when)


def _walk_at_a_turning_robot(bearing: float, distance: float, turn: float, when: float) -> None:
    """Simulate small steps: the robot turns as far as allowed, the person walks straight at it."""
    speed = 1.0
    for _ in range(6):  # find a speed at which the robot obeys its own limit
        speed = min(speed, limit(bearing, distance, speed).speed_limit_mps)
    if speed <= 0.05:
        return
    dt, t, heading = 0.01, 0.0, 0.0
    base, worker = np.zeros(2), distance * np.array([math.cos(bearing), math.sin(bearing)])
    stop_s = ROBOT.reaction_time_s + speed / ROBOT.max_deceleration_mps2
    start_s, turning_s = when * 0.5 * stop_s, 0.5 * stop_s
    while speed > 0.0:
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
        towards = base - worker
        worker = worker + 1.6 * dt * towards / np.linalg.norm(towards)
        t += dt
        assert _gap_m(base, heading, worker) > POLICY.margins.separation_clearance_m - 0.03


def _gap_m(base: np.ndarray, heading: float, worker: np.ndarray) -> float:
    c, s = math.cos(heading), math.sin(heading)
    x, y = worker - base
    inside = np.abs([c * x + s * y, c * y - s * x]) - [0.3625, 0.25]
    return float(np.linalg.norm(np.maximum(inside, 0.0))) - BODY_RADIUS_M


def test_zones_and_caps_only_ever_lower_the_limit_and_are_named() -> None:
    zones = SpeedRules(zones=DistanceZones(stop_within_m=1.0, full_speed_beyond_m=8.0))
    cap = SpeedRules(near_cap=NearCap(within_m=2.0, speed_mps=0.3))
    for rules, name in ((zones, "distance zone"), (cap, "cap near people")):
        policy = POLICY.model_copy(update={"rules": rules})
        for distance in np.linspace(0.5, 9.0, 35):
            plain, ruled = limit(0.0, distance, 0.0), limit(0.0, distance, 0.0, policy)
            assert ruled.speed_limit_mps <= plain.speed_limit_mps
            if ruled.speed_limit_mps < plain.speed_limit_mps:
                assert ruled.limited_by == f"track 1: {name}"
    distance = 5.0 + 0.3625 + BODY_RADIUS_M
    ruled = limit(0.0, distance, 0.0, POLICY.model_copy(update={"rules": zones}))
    assert ruled.speed_limit_mps == pytest.approx(1.5 * 4.0 / 7.0)


def test_the_limiting_rule_and_person_are_named() -> None:
    rules = SpeedRules(near_cap=NearCap(within_m=2.0, speed_mps=0.3))
    adapter = NavAdapter(POLICY.model_copy(update={"rules": rules}), ROBOT)
    tracks = (
        person(track_id=4, position=(2.2, 0.0), awareness_lower=1.0),
        person(track_id=7, position=(3.5, 0.0)),
        person(track_id=9, position=(1.0, 0.0)),
    )
    assert adapter.update(tracks[:2], robot_at(), 0.0).limited_by == "track 4: cap near people"
    result = adapter.update(tracks, robot_at(), 0.0)
    assert result.limited_by == "track 9: speed and separation"


@pytest.mark.parametrize(("speed", "suffices"), [(0.5, True), (0.85, True), (1.2, False)])
def test_braking_suffices_is_false_when_the_robot_is_too_fast(speed: float, suffices: bool) -> None:
    """1.2 m of way and walking to spare; at 1.2 m/s full braking takes 0.72 + 1.92 m."""
    result = limit(0.0, 2.6625, speed)
    assert result.braking_suffices is suffices
    needed = speed**2 / 2.0 + 1.6 * speed + 0.1
    assert (needed <= 2.0) is suffices


@given(distance=finite(0.0, 6.0), bearing=finite(-math.pi, math.pi), share=finite(0.0, 1.0))
def test_who_obeys_can_always_brake(distance: float, bearing: float, share: float) -> None:
    allowed = limit(bearing, distance, 0.0).speed_limit_mps
    assert limit(bearing, distance, share * allowed).braking_suffices
