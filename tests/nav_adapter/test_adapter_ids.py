"""Ids of a foreign tracker: nobody inherits awareness, and whoever loses an id is kept."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, finite, person, policy_radius_m, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.ros2 import STOP_POLYGON_ID
from tracking import PersonTrack

PERIOD_S = 0.05
FAR, NEAR = (6.0, 0.0), (1.5, 0.6)
UNAWARE_M = policy_radius_m(AwarenessPolicy(), 0.0)


def frame(adapter: NavAdapter, now: float, *tracks: PersonTrack) -> NavConstraints:
    return adapter.update(
        [replace(track, stamp_s=now) for track in tracks], robot_at(now, speed_mps=0.1), now
    )


def seen(adapter: NavAdapter, frames: int, *tracks: PersonTrack, start: int = 0) -> NavConstraints:
    for k in range(start, start + frames):
        result = frame(adapter, k * PERIOD_S, *tracks)
    return result


def somebody(track_id: int, at: tuple[float, float], alpha: float, **more: float) -> PersonTrack:
    return person(track_id=track_id, position=at, awareness_lower=alpha, sigma_m=0.05, **more)


@pytest.mark.parametrize("alpha", [0.3, 0.95])
def test_at_first_sight_awareness_raises_no_limit(alpha: float) -> None:
    adapter, blind = (NavAdapter(AwarenessPolicy(), ROBOT) for _ in range(2))
    aware, unaware = somebody(1, (2.5, 0.0), alpha), somebody(1, (2.5, 0.0), 0.0)
    for k in range(8):
        now = k * PERIOD_S
        limit = frame(adapter, now, aware).speed_limit_mps
        lowest = frame(blind, now, unaware).speed_limit_mps
        if k < 4:
            assert limit == lowest
    assert limit > lowest or alpha < 0.5


def test_frames_of_a_tentative_track_are_sight_and_repeats_of_one_frame_are_not() -> None:
    ahead = somebody(1, (2.5, 0.0), 0.95)
    unaware = frame(adapter(), 0.0, replace(ahead, awareness_lower=0.0)).speed_limit_mps
    nav, repeats = adapter(), adapter()
    seen(nav, 5, replace(ahead, status="tentative", awareness_lower=0.0))
    assert frame(nav, 5 * PERIOD_S, ahead).speed_limit_mps > unaware
    for now in (k * PERIOD_S for k in range(5)):
        result = repeats.update((ahead,), robot_at(now, speed_mps=0.1), now)
    assert result.speed_limit_mps <= unaware


def test_whoever_had_a_reused_id_is_kept_for_a_second() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    seen(adapter, 40, somebody(1, NEAR, 0.9))
    for k in range(40, 58):
        result = frame(adapter, k * PERIOD_S, somebody(1, FAR, 0.0))
        ids = [each.track_id for each in result.obstacles]
        assert ids == [-2, 1]
        assert STOP_POLYGON_ID not in ids
        lost = result.obstacles[0]
        assert lost.center_odom_m == pytest.approx(NEAR)
        assert lost.awareness_lower == 0.0
    result = seen(adapter, 10, somebody(1, FAR, 0.0), start=58)
    assert [each.track_id for each in result.obstacles] == [1]


@given(
    speed=finite(0.0, 3.0),
    course=finite(-math.pi, math.pi),
    turn=finite(-math.pi, math.pi),
    sigma=finite(0.0, 0.3),
    period=st.sampled_from([0.05, 0.2, 0.5]),
)
def test_nobody_who_walks_counts_as_new(speed, course, turn, sigma, period) -> None:
    """Not even somebody who stops or turns on the spot between two frames."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    place, shown = np.array([5.0, 0.0]), []
    for k in range(8):
        heading = course + (turn if k >= 4 else 0.0)
        walking = min(speed, 1.5) if k >= 4 else speed
        velocity = walking * np.array([math.cos(heading), math.sin(heading)])
        if k > 0:
            place = place + period * velocity
        track = person(
            k * period,
            position=place.tolist(),
            velocity=velocity.tolist(),
            sigma_m=sigma,
            awareness_lower=0.9,
        )
        result = adapter.update((track,), robot_at(k * period), k * period)
        shown.append([each.awareness_lower for each in result.obstacles])
    assert shown == [[0.9]] * 8


@given(distance=finite(0.0, 8.0), sigma=finite(0.01, 0.3), bearing=finite(-math.pi, math.pi))
def test_a_jump_beyond_covariance_and_human_speed_is_first_sight(distance, sigma, bearing) -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    moved = 4.0 + distance * math.cos(bearing), distance * math.sin(bearing)
    first = person(track_id=7, position=(4.0, 0.0), sigma_m=sigma, awareness_lower=0.9)
    seen(adapter, 20, first)
    result = frame(adapter, 20 * PERIOD_S, replace(first, position_odom_m=np.array(moved)))
    (obstacle,) = (each for each in result.obstacles if each.track_id == 7)
    reach_m = 1.6 * PERIOD_S + 4.0 * math.sqrt(2.0) * sigma
    if distance > reach_m + 0.06:
        assert obstacle.awareness_lower == 0.0
        assert obstacle.radius_m == pytest.approx(UNAWARE_M + 2.0 * sigma)
    elif distance < reach_m:
        assert obstacle.awareness_lower == 0.9


POLICY = AwarenessPolicy()


def adapter() -> NavAdapter:
    return NavAdapter(POLICY, ROBOT)


@pytest.mark.parametrize("dead", ["everything", "odometry"])
def test_the_reachable_limit_falls_to_zero_when_the_robots_state_repeats(dead: str) -> None:
    nav = adapter()
    for k in range(20):
        nav.update([person(k * 0.05, position=(6, 0))], robot_at(k * 0.05, speed_mps=1.0), k * 0.05)
    last = robot_at(0.95, speed_mps=1.0)
    for k in range(20, 80):
        now = k * 0.05
        if dead == "everything":
            result = nav.watchdog(now)
        else:
            result = nav.update([person(now, position=(6, 0))], last, now)
    assert result.speed_limit_mps == 0.0
    assert result.reachable_speed_limit_mps == 0.0


@pytest.mark.parametrize(
    ("before", "after", "ids"),
    [
        ({1: (2.0, 0.0), 2: (2.0, 0.4)}, {1: (8.0, 0.0), 2: (2.0, 0.4)}, [-2, 1, 2]),
        ({1: (2, 0.1), 2: (2, -0.1)}, {1: (8, 3), 2: (8, -3), 3: (2, 0)}, [-2, 1, 2, 3]),
        ({1: (2.0, 0.0)}, {1: (8.0, 0.0), -7: (2.02, 0.0)}, [-2, 1]),
    ],
    ids=["neighbour", "one new track", "clutter"],
)
def test_who_stands_for_nobody_whose_id_has_jumped(before, after, ids) -> None:
    """A neighbour for none, a new track for one, and clutter (here with a negative id) for none."""
    nav = adapter()
    limit = seen(nav, 40, *(somebody(i, at, 0.0) for i, at in before.items()))
    jumped = [
        replace(somebody(abs(i), at, 0.0), status="tentative" if i < 0 else "confirmed")
        for i, at in after.items()
    ]
    frame(nav, 2.0, *jumped)
    kept = frame(nav, 2.05, *(each for each in jumped if each.status == "confirmed"))
    assert [each.track_id for each in kept.obstacles] == ids
    assert kept.speed_limit_mps <= limit.speed_limit_mps + 1e-9


def test_after_a_silence_an_id_is_first_sight_for_the_speed() -> None:
    unaware = (
        adapter().update([person(position=(2.2, 0))], robot_at(speed_mps=1.2), 0.0).speed_limit_mps
    )
    limits = []
    for track_id in (1, 5):
        nav = adapter()
        for k in range(20):
            now = k * 0.05
            nav.update([person(now, position=(-4, 0))], robot_at(now, speed_mps=1.2), now)
        track = person(5.95, track_id=track_id, position=(2.2, 0), awareness_lower=0.95)
        limits.append(nav.update([track], robot_at(5.95, speed_mps=1.2), 5.95).speed_limit_mps)
    assert limits[0] == limits[1] == unaware


def test_a_person_once_confirmed_is_kept_although_the_track_was_tentative_at_last() -> None:
    nav = adapter()
    for k in range(40):
        nav.update([person(k * 0.05)], robot_at(k * 0.05), k * 0.05)
    before = nav.update([person(2.0, status="tentative")], robot_at(2.0), 2.0)
    after = nav.update([], robot_at(2.05), 2.05)
    assert [each.track_id for each in after.obstacles] == [1]
    assert after.speed_limit_mps <= before.speed_limit_mps + 1e-9
