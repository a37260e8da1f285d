"""The adapter's clock: one wrong stamp costs one update, a clock that was set costs a second."""

from __future__ import annotations

import logging
from itertools import pairwise

import pytest
from nav_scenes import ROBOT, T_ODOM_CAMERA, numbers, observed, person, policy_radius_m, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError
from tracking import PersonTracker

PERIOD_S = 0.1
UNAWARE_M, AWARE_M = (policy_radius_m(AwarenessPolicy(), alpha) for alpha in (0.0, 0.9))


def step(adapter: NavAdapter, now: float, *, robot_s: float | None = None) -> NavConstraints:
    """Update with somebody aware 3 m ahead, seen just now, and a robot at 0.5 m/s."""
    seen_s = now if robot_s is None else robot_s
    track = person(seen_s, awareness_lower=0.9)
    return adapter.update((track,), robot_at(seen_s, speed_mps=0.5), now)


def play(adapter: NavAdapter, start_s: float, updates: int) -> tuple[int, list[NavConstraints]]:
    """Return the number of refused updates, and the constraints of the others."""
    refused, results = 0, []
    for k in range(updates):
        try:
            results.append(step(adapter, start_s + k * PERIOD_S))
        except NavError:
            refused += 1
    return refused, results


@pytest.mark.parametrize("jump_s", [11.0, 3600.0, 1e9, -1.0, -3600.0])
def test_one_wrong_stamp_costs_one_update(jump_s: float) -> None:
    adapter, twin = (NavAdapter(AwarenessPolicy(), ROBOT) for _ in range(2))
    for k in range(60):
        now = 100.0 + k * PERIOD_S
        if k % 20 == 10:
            with pytest.raises(NavError, match=r"jumps ahead|must not go backward"):
                step(adapter, now + jump_s, robot_s=now if jump_s > 0.0 else None)
        assert numbers(step(adapter, now)) == numbers(step(twin, now))
    assert (adapter.refused_stamps, adapter.clock_restarts) == (3, 0)


def test_an_update_far_ahead_is_forgotten_if_the_clock_returns() -> None:
    """It may have been a pause of the caller, so it is not refused."""
    adapter, twin = (NavAdapter(AwarenessPolicy(), ROBOT) for _ in range(2))
    play(adapter, 100.0, 20), play(twin, 100.0, 20)
    jumped = step(adapter, 3700.0)
    assert jumped.obstacles[0].awareness_lower == 0.9
    assert jumped.obstacles[0].radius_m == pytest.approx(UNAWARE_M)
    for k in range(20, 40):
        now = 100.0 + k * PERIOD_S
        assert numbers(step(adapter, now)) == numbers(step(twin, now))
    assert (adapter.refused_stamps, adapter.clock_restarts) == (1, 0)


def test_a_pause_of_the_caller_is_no_jump() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    play(adapter, 0.0, 20)
    refused, results = play(adapter, 600.0, 40)
    assert (refused, adapter.refused_stamps, adapter.clock_restarts) == (0, 0, 0)
    assert results[0].obstacles[0].radius_m == pytest.approx(UNAWARE_M)
    assert results[-1].obstacles[0].radius_m == pytest.approx(AWARE_M)


@pytest.mark.parametrize("back_s", [1.5, 3600.0, 1e9])
def test_a_clock_that_was_set_back_costs_a_second(back_s, caplog) -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    _, before = play(adapter, 5000.0, 40)
    with caplog.at_level(logging.WARNING, logger="nav_adapter"):
        refused, after = play(adapter, 5003.9 - back_s, 60)
    assert refused * PERIOD_S == pytest.approx(1.0, abs=1.5 * PERIOD_S)
    assert adapter.refused_stamps == refused
    assert adapter.clock_restarts == 1
    assert "the clock has been set" in caplog.text
    # First sight again: the largest obstacle, and the limit rises no faster than the robot.
    assert after[0].obstacles[0].radius_m == pytest.approx(UNAWARE_M)
    assert after[0].speed_limit_mps <= min(before[-1].speed_limit_mps, 0.5)
    for one, other in pairwise(after):
        assert other.speed_limit_mps - one.speed_limit_mps <= PERIOD_S + 1e-6
    assert after[-1].obstacles[0].radius_m == pytest.approx(AWARE_M)


def test_a_watchdog_far_ahead_stops_and_leaves_the_clock_alone() -> None:
    adapter, twin = (NavAdapter(AwarenessPolicy(), ROBOT) for _ in range(2))
    play(adapter, 0.0, 20), play(twin, 0.0, 20)
    for ahead_s in (12.0, 3600.0, 1e9):
        late = adapter.watchdog(ahead_s)
        assert late.stale
        assert late.speed_limit_mps == 0.0
    assert numbers(step(adapter, 2.0)) == numbers(step(twin, 2.0))
    assert adapter.refused_stamps == 0


@pytest.mark.parametrize("resets", [1, 2])
def test_resets_forget_people_and_clock_and_let_the_limit_rise_slowly(resets: int) -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    close = person(50.0, position=(1.5, 0.0))
    low = adapter.update((close,), robot_at(50.0), 50.0).speed_limit_mps
    for _ in range(resets):
        adapter.reset()
    free = adapter.update((), robot_at(1.0), 1.0)
    assert free.obstacles == ()
    assert free.speed_limit_mps == low < ROBOT.max_speed_mps
    for k in range(1, 30):
        free = adapter.update((), robot_at(1.0 + k * PERIOD_S), 1.0 + k * PERIOD_S)
    assert free.speed_limit_mps == ROBOT.max_speed_mps


FRAME_S = 0.05
SET_BACK_AT_S = 4.0
POLICY = AwarenessPolicy()


def drive(
    back_s: float, walking_mps: float, *, everywhere: bool
) -> dict[float, NavConstraints | None]:
    """Return the constraints by the time since the clock was set back a little.

    None stands for a refusal. The tracker cannot tell its frames from late ones, and puts them back
    in time: the awareness of the last frames before stays until the new stamps have passed them,
    and somebody who walks has a second track for a while.

    Somebody watches the robot up to that instant and then looks away. ``everywhere`` is False if
    only the camera's clock is set back.
    """
    tracker, adapter = PersonTracker(), NavAdapter(POLICY, ROBOT)
    results: dict[float, NavConstraints | None] = {}
    for step in range(round((SET_BACK_AT_S + 2.0) / FRAME_S)):
        true_s = step * FRAME_S
        late = true_s >= SET_BACK_AT_S
        stamp_s = true_s - back_s if late else true_s
        now = stamp_s if everywhere else true_s
        place = (4.0, walking_mps * (true_s - SET_BACK_AT_S))
        frame = observed(stamp_s, place, 0.05 if late else 0.95)
        tracks = tracker.update([frame], stamp_s, T_ODOM_CAMERA)
        try:
            result = adapter.update(tracks, robot_at(now), now)
        except NavError:
            result = None
        results[round(true_s - SET_BACK_AT_S, 3)] = result
    assert tracker.refused_late_frames == 0
    return results


def most_aware(constraints: NavConstraints) -> float:
    return max(obstacle.awareness_lower for obstacle in constraints.obstacles)


@pytest.mark.parametrize("everywhere", [False, True], ids=["camera", "robot"])
@pytest.mark.parametrize(("back_s", "walking_mps"), [(0.1, 1.2), (0.3, 0.0), (0.49, 1.2)])
def test_once_a_clock_has_caught_up_nobody_is_aware(back_s, walking_mps, everywhere) -> None:
    """With that of the robot there are no constraints until then."""
    results = drive(back_s, walking_mps, everywhere=everywhere)
    in_time = drive(0.0, walking_mps, everywhere=everywhere)
    assert most_aware(results[-FRAME_S]) > 0.6
    refused = [age_s for age_s, result in results.items() if result is None]
    if everywhere:
        assert refused[0] == 0.0
        assert back_s - 2.1 * FRAME_S <= refused[-1] < back_s
    else:
        assert refused == []
    fresh_s = POLICY.timing.fresh_within_s + (FRAME_S if everywhere else 0.0)
    for age_s, result in results.items():
        if age_s > fresh_s + 1e-9 and result is not None:
            assert everywhere or most_aware(result) < POLICY.speed.unaware_below
            slack_mps = 0.02 if everywhere else 1e-6
            assert result.speed_limit_mps <= in_time[age_s].speed_limit_mps + slack_mps
            assert min(obstacle.radius_m for obstacle in result.obstacles) >= 1.0


@pytest.mark.parametrize("ahead_s", [0.6, 9.9])
@pytest.mark.parametrize("by", ["update", "watchdog"])
def test_a_stamp_a_few_seconds_ahead_costs_one_update(ahead_s: float, by: str) -> None:
    nav = NavAdapter(POLICY, ROBOT)
    for k in range(120):
        now = 100.0 + k * 0.1
        if k == 50:
            ahead = now + ahead_s
            if by == "watchdog":
                nav.watchdog(ahead)
            else:
                nav.update([person(ahead)], robot_at(ahead, speed_mps=0.5), ahead)
        result = nav.update([person(now, awareness_lower=0.9)], robot_at(now), now)
        if k > 20:
            assert result.obstacles[0].radius_m == pytest.approx(policy_radius_m(POLICY, 0.9))
    assert nav.clock_restarts == 0
    assert nav.refused_stamps == (1 if by == "update" else 0)
