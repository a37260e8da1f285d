"""Missing input: everyone is unaware, then the robot stops, and later it starts with a ramp."""

from __future__ import annotations

from itertools import pairwise

import pytest
from nav_scenes import ROBOT, numbers, person, policy_radius_m, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavError

PERIOD_S = 0.05


def driving(seconds: float = 2.0) -> NavAdapter:
    """Return an adapter after updates with an attentive person and a robot at 1 m/s."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    for step in range(round(seconds / PERIOD_S) + 1):
        now = step * PERIOD_S
        track = person(now, position=(4.0, 0.0), awareness_lower=1.0)
        adapter.update((track,), robot_at(now, speed_mps=1.0), now, perception_stamp_s=now)
    return adapter


def test_before_any_input_the_watchdog_returns_a_stop() -> None:
    result = NavAdapter(AwarenessPolicy(), ROBOT).watchdog(3.0)
    assert (result.speed_limit_mps, result.stale, result.obstacles) == (0.0, True, ())
    assert result.limited_by == "stale data: none yet"


def test_without_input_everyone_becomes_unaware_and_then_the_robot_stops() -> None:
    adapter = driving()
    before = adapter.watchdog(2.0)
    assert not before.stale
    limits, radii = [before.speed_limit_mps], [before.obstacles[0].radius_m]
    for step in range(1, 40):
        now = 2.0 + step * PERIOD_S
        result = adapter.watchdog(now)
        assert result.stale is (now - 2.0 > 0.5 + 1e-9)
        limits.append(result.speed_limit_mps)
        if result.obstacles:
            radii.append(result.obstacles[0].radius_m)
        if result.stale:
            assert all(o.awareness_lower == 0.0 for o in result.obstacles)
        assert result.alerts == () or not result.stale
    assert limits == sorted(limits, reverse=True)
    assert radii == sorted(radii)
    assert limits[-1] == 0.0
    assert result.limited_by.startswith("stale data: ")


def test_the_watchdog_is_an_update_with_the_latest_input() -> None:
    watched, updated = driving(), driving()
    for now in (2.1, 2.4, 2.7):
        track = person(2.0, position=(4.0, 0.0), awareness_lower=1.0)
        state = robot_at(2.0, speed_mps=1.0)
        expected = updated.update((track,), state, now, perception_stamp_s=2.0)
        assert numbers(watched.watchdog(now)) == numbers(expected)
    with pytest.raises(NavError, match="must not go backward"):
        watched.watchdog(2.6)


@pytest.mark.parametrize("silent", [True, False], ids=["no update", "watchdog"])
def test_the_limit_recovers_with_a_ramp(silent: bool) -> None:
    adapter = driving()
    if not silent:
        for step in range(1, 40):
            stopped = adapter.watchdog(2.0 + step * PERIOD_S)
        assert stopped.speed_limit_mps == 0.0
    limits, reasons, radii = [], [], []
    for step in range(80):
        now = 4.0 + step * PERIOD_S
        track = person(now, position=(6.0, 0.0), awareness_lower=1.0)
        result = adapter.update((track,), robot_at(now), now, perception_stamp_s=now)
        limits.append(result.speed_limit_mps)
        reasons.append(result.limited_by)
        radii.append(result.obstacles[0].radius_m)
    # The robot stands: the limit starts with at most ``fresh_within_s`` of acceleration.
    assert limits[0] <= ROBOT.max_acceleration_mps2 * 0.25
    steps = [after - before for before, after in pairwise(limits)]
    assert max(steps) <= ROBOT.max_acceleration_mps2 * PERIOD_S + 1e-9
    assert reasons[0] == "recovery after stale data"
    assert limits[-1] == 1.5
    assert reasons[-1] == "robot maximum"
    # A sighting counts for at most 0.25 s, in which a radius shrinks by half as much.
    assert radii[0] >= policy_radius_m(AwarenessPolicy(), 0.0) - 0.5 * 0.25 - 1e-9
    assert radii[-1] == pytest.approx(policy_radius_m(AwarenessPolicy(), 1.0))
