"""The adapter over time: shrinking, losing the camera, holding, staleness, silence."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import (
    FLOOR_M,
    ROBOT,
    SCANNER,
    finite,
    numbers,
    person,
    policy_radius_m,
    robot_at,
    settled_update,
)

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError
from nav_adapter.course import course_of
from nav_adapter.limit import in_the_path_mps
from nav_adapter.policies import SafetyMargins
from nav_adapter.rigid import Motion
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

PERIOD_S = 0.05
RATE_MPS = AwarenessPolicy().timing.shrink_rate_mps
FRESH_S = AwarenessPolicy().timing.fresh_within_s
UNAWARE_M, AWARE_M = (policy_radius_m(AwarenessPolicy(), alpha) for alpha in (0.0, 1.0))


def watch(adapter: NavAdapter, seconds: float, *, start_s: float = 0.0) -> list[NavConstraints]:
    """Show an attentive person at 20 Hz."""
    results = []
    for step in range(round(seconds / PERIOD_S)):
        now = start_s + step * PERIOD_S
        results.append(adapter.update((person(now, awareness_lower=1.0),), robot_at(now), now))
    return results


def radius(constraints: NavConstraints) -> float:
    (obstacle,) = constraints.obstacles
    return obstacle.radius_m


def test_a_person_starts_large_and_shrinks_at_the_bounded_rate() -> None:
    radii = [radius(result) for result in watch(NavAdapter(AwarenessPolicy(), ROBOT), 2.0)]
    assert radii[0] == UNAWARE_M
    for step, found in enumerate(radii):
        expected_m = max(UNAWARE_M - RATE_MPS * PERIOD_S * step, AWARE_M)
        assert found == pytest.approx(expected_m)
    assert radii[-1] == AWARE_M < UNAWARE_M - 0.2


@pytest.mark.parametrize("late_s", [0.0, 0.2, 0.3, 0.45])
def test_late_frames_reduce_the_uncertainty_of_the_first_sighting(late_s: float) -> None:
    """A slow camera still shows the position; only its evidence of awareness is too old."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    radii = []
    for step in range(60):
        now = step * PERIOD_S
        sigma_m = 0.4 if step == 0 else 0.05
        track = person(now, sigma_m=sigma_m, unseen_s=late_s, awareness_lower=0.0)
        radii.append(radius(adapter.update((track,), robot_at(now), now)))
    assert radii[0] == pytest.approx(UNAWARE_M + 2.0 * 0.4)
    assert radii[-1] == pytest.approx(UNAWARE_M + 2.0 * 0.05)
    assert max(before - after for before, after in pairwise(radii)) <= RATE_MPS * PERIOD_S + 1e-9


def test_obstacles_grow_at_once() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    watch(adapter, 2.0)
    result = adapter.update((person(2.0, awareness_lower=0.0),), robot_at(2.0), 2.0)
    assert radius(result) == UNAWARE_M


@pytest.mark.parametrize("control_period_s", [0.01, 0.2])
def test_shrinking_depends_on_time_and_not_on_the_number_of_updates(control_period_s) -> None:
    """With a 20 Hz camera, any rate of the control loop gives the same radius at the same time."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    for step in range(round(0.6 / control_period_s) + 1):
        now = step * control_period_s
        frame = PERIOD_S * int(now / PERIOD_S + 1e-9)
        result = adapter.update((person(frame, awareness_lower=1.0),), robot_at(now), now)
    # The first frame counts as aware only if there are two updates with it.
    late_s = max(control_period_s, PERIOD_S)
    expected = UNAWARE_M - RATE_MPS * 0.6
    assert radius(result) == pytest.approx(expected, abs=RATE_MPS * late_s + 1e-9)


Loss = Callable[[float, float], PersonTrack]
LOSSES: dict[str, Loss] = {
    # The tracker predicts, or gets empty frames, or is not called.
    "predicted": lambda lost, now: person(
        now, status="confirmed", awareness_lower=1.0, unseen_s=now - lost
    ),
    "coasting": lambda lost, now: person(
        now, status="coasting", awareness_lower=1.0, unseen_s=now - lost
    ),
    "repeated": lambda lost, now: person(lost, awareness_lower=1.0),
}


@pytest.mark.parametrize("seen_s", [0.05, 0.4])
@pytest.mark.parametrize("loss", LOSSES.values(), ids=LOSSES)
@pytest.mark.parametrize("period_s", [0.02, 0.3])
def test_losing_the_camera_never_shrinks_a_radius(loss, seen_s, period_s) -> None:
    """Not even while it is shrinking, or right after the loss."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    before = watch(adapter, seen_s)[-1]
    lost = before.stamp_s
    for step in range(1, round(1.0 / period_s) + 1):
        now = lost + step * period_s
        after = adapter.update((loss(lost, now),), robot_at(now), now)
        assert radius(after) >= radius(before)
        assert after.speed_limit_mps <= before.speed_limit_mps + 1e-12
        before = after
    assert radius(before) == UNAWARE_M
    assert before.obstacles[0].awareness_lower == 0.0


@given(
    walk=st.lists(
        st.tuples(
            st.sampled_from([0.0, 0.01, 0.05, 0.3, 2.0]),
            st.sampled_from([None, "frame", "repeat", *LOSSES]),
            finite(0.0, 1.0),
            finite(0.0, 0.2),
            st.sampled_from(["tentative", "confirmed", "coasting"]),
        ),
        max_size=20,
    )
)
def test_a_radius_shrinks_only_by_the_time_in_new_frames(walk) -> None:
    """Any sequence of frames, repeats, predictions and disappearances."""
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    now, frame, before = 0.0, 0.0, None
    latest = person()
    for dt, event, alpha, sigma, status in walk:
        now, previous = now + dt, frame
        if event == "frame":
            frame = now
            latest = person(now, status=status, awareness_lower=alpha, sigma_m=sigma)
        elif event in LOSSES:
            latest = LOSSES[event](frame, now)
        tracks = () if event is None else (latest,)
        result = adapter.update(tracks, robot_at(now), now)
        if not result.obstacles:
            before = None
            continue
        (after,) = result.obstacles
        assert after.radius_m >= FLOOR_M
        if before is not None:
            shrink_m = RATE_MPS * (frame - previous) if latest.status == "confirmed" else 0.0
            # Frames that came while the track was absent count once, when it is back.
            assert after.radius_m >= before.radius_m - shrink_m - 1e-9
            if frame == previous:
                assert after.radius_m >= before.radius_m
                assert after.awareness_lower <= before.awareness_lower
        before = after


@pytest.mark.parametrize(
    ("changes", "trusted"),
    [
        ({}, True),
        ({"status": "coasting", "time_since_seen_s": 0.2}, True),
        ({"status": "coasting", "time_since_seen_s": 0.3}, False),
        ({"status": "confirmed", "time_since_seen_s": 0.3}, False),
        ({"status": "tentative"}, False),
    ],
)
def test_awareness_counts_only_for_tracks_seen_recently(changes, trusted) -> None:
    track = replace(person(awareness_lower=1.0), **changes)
    result = settled_update((track,))
    unaware = settled_update((person(),))
    assert result.obstacles[0].awareness_lower == (1.0 if trusted else 0.0)
    assert (result.speed_limit_mps > unaware.speed_limit_mps) is trusted


def test_a_confirmed_person_who_disappears_is_held_as_unaware_and_moving() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    for step in range(41):
        now = step * PERIOD_S
        track = person(now, position=(3.0, now), velocity=(0.0, 1.0), awareness_lower=1.0)
        seen = adapter.update((track,), robot_at(now), now)
    assert seen.obstacles[0].radius_m == pytest.approx(AWARE_M)
    for gone_s in (0.1, 0.5, 0.99):
        now = 2.0 + gone_s
        held = adapter.update((), robot_at(now), now)
        (obstacle,) = held.obstacles
        assert obstacle.center_odom_m == pytest.approx([3.0, now])
        assert obstacle.radius_m == UNAWARE_M
        assert obstacle.awareness_lower == 0.0
        assert held.speed_limit_mps < seen.speed_limit_mps
        assert held.limited_by == "track 1: reach"
    assert adapter.update((), robot_at(3.01), 3.01).obstacles == ()


def test_a_person_who_returns_continues_with_the_held_radius() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    watch(adapter, 2.0)
    adapter.update((), robot_at(2.3), 2.3)
    back = adapter.update((person(2.6, awareness_lower=1.0),), robot_at(2.6), 2.6)
    # One sighting is no evidence for the whole time of the absence.
    assert radius(back) == pytest.approx(UNAWARE_M - RATE_MPS * FRESH_S)
    for step in range(1, 6):
        now = 2.6 + step * PERIOD_S
        back = adapter.update((person(now, awareness_lower=1.0),), robot_at(now), now)
    assert radius(back) == pytest.approx(UNAWARE_M - RATE_MPS * (FRESH_S + 5 * PERIOD_S))


@given(
    seen_sigmas=finite(0.0, 3.0),
    unseen_sigmas=finite(0.0, 4.0),
    sigma_m=finite(0.0, 0.4),
    reach=st.booleans(),
)
@settings(max_examples=20)
def test_unseen_people_count_with_more_standard_deviations(
    seen_sigmas, unseen_sigmas, sigma_m, reach
):
    """As many of a tracked place as if the place were certain and the clearance as much larger."""
    policy = AwarenessPolicy() if reach else AwarenessPolicy(without=SCANNER)

    def limit_mps(margins: SafetyMargins, sigma_m: float, unseen_s: float) -> float:
        adapter = NavAdapter(policy.model_copy(update={"margins": margins}), ROBOT)
        track = person(position=(2.5, 0.0), sigma_m=sigma_m, unseen_s=unseen_s)
        return adapter.update((track,), robot_at(), 0.0).speed_limit_mps

    margins = SafetyMargins(uncertainty_sigmas=seen_sigmas, unseen_sigmas=unseen_sigmas)
    for unseen_s, sigmas in ((0.24, seen_sigmas), (0.26, max(seen_sigmas, unseen_sigmas))):
        wider = SafetyMargins(clearance_m=0.10 + sigmas * sigma_m)
        expected_mps = limit_mps(wider, 0.0, unseen_s)
        assert limit_mps(margins, sigma_m, unseen_s) == pytest.approx(expected_mps, abs=0.03)


def test_obstacles_stop_growing_during_a_long_silence() -> None:
    """A walker with an uncertain velocity, then no input for half a minute."""
    walker = person(position=(6.0, 0.0), velocity=(0.0, 1.0), sigma_m=0.1)
    covariance = np.diag([0.01, 0.01, 0.09, 0.09])
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    adapter.update((replace(walker, covariance_odom=covariance),), robot_at(), 0.0)
    for step in range(1, 31):
        result = adapter.watchdog(float(step))
    assert result.speed_limit_mps == 0.0
    sigma_m = math.sqrt(0.01 + 1.5**2 * 0.09)
    assert radius(result) == pytest.approx(UNAWARE_M + 2.0 * sigma_m)
    silent = NavAdapter(AwarenessPolicy(), ROBOT)
    silent.update((replace(walker, covariance_odom=covariance),), robot_at(), 0.0)
    back = silent.update((person(30.0, awareness_lower=1.0),), robot_at(30.0), 30.0)
    assert radius(back) == pytest.approx(UNAWARE_M + 0.2)


def test_a_tentative_or_long_unseen_person_is_not_held() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    tracks = (
        person(status="tentative"),
        person(track_id=2, status="coasting", unseen_s=0.95),
        person(track_id=3),
    )
    adapter.update(tracks, robot_at(), 0.0)
    result = adapter.update((), robot_at(0.1), 0.1)
    assert [obstacle.track_id for obstacle in result.obstacles] == [3]


def test_without_a_stamp_of_perception_the_newest_track_counts() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    tracks = (person(0.0, awareness_lower=1.0), person(0.3, track_id=2, awareness_lower=1.0))
    assert not adapter.update(tracks, robot_at(0.7), 0.7).stale
    assert adapter.update(tracks, robot_at(0.81), 0.81).stale
    stopped = adapter.update(tracks, robot_at(1.81), 1.81)
    assert (stopped.speed_limit_mps, stopped.stale) == (0.0, True)
    assert stopped.limited_by == "stale data: perception is 1.51 s old"


def test_the_limit_for_a_braking_robot_falls_no_faster_than_it_can_brake() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    adapter.update((), robot_at(speed_mps=1.2), 0.0)
    close = person(0.1, position=(1.0, 0.0))
    result = adapter.update((close,), robot_at(0.1, speed_mps=1.2), 0.1)
    assert result.speed_limit_mps == 0.0
    assert result.reachable_speed_limit_mps == pytest.approx(1.2 - 0.1)


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


FAST = robot_at(speed_mps=1.4)


def test_a_robot_that_stands_has_braked() -> None:
    touching = person(position=(0.5, 0.0), velocity=(-1.0, 0.0))
    constraints = NavAdapter(AwarenessPolicy(), ROBOT).update([touching], robot_at(), 0.0)
    assert constraints.speed_limit_mps == 0.0
    assert constraints.braking_suffices


@pytest.mark.parametrize("sigma_m", [0.0, 0.1, 0.3])
def test_the_protective_field_counts_how_near_the_person_may_be(sigma_m: float) -> None:
    policy = AwarenessPolicy(without=SCANNER)
    standing = person(position=(2.0, 0.0), sigma_m=sigma_m)
    found = NavAdapter(policy, ROBOT).update([standing], FAST, 0.0).speed_limit_mps
    body_m = BODY_RADIUS_M + policy.margins.uncertainty_sigmas * sigma_m
    field = course_of(ROBOT, Motion.of(FAST), 0.0).grown(policy.margins.clearance_m)
    assert found == pytest.approx(in_the_path_mps((2.0, 0.0), body_m, field))


def test_after_a_pause_the_limit_rises_from_the_robots_speed() -> None:
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    assert adapter.update([], robot_at(), 0.0).speed_limit_mps == ROBOT.max_speed_mps
    fresh_s = AwarenessPolicy().timing.fresh_within_s
    for step, (stamp_s, speed_mps) in enumerate([(0.6, 0.4), (0.7, 0.4), (0.8, 0.5)]):
        constraints = adapter.update([], robot_at(stamp_s, speed_mps=speed_mps), stamp_s)
        expected = 0.4 + ROBOT.max_acceleration_mps2 * (fresh_s + 0.1 * step)
        assert constraints.speed_limit_mps == pytest.approx(expected)
        assert constraints.limited_by == "recovery after stale data"


def test_time_without_a_sighting_is_no_time_in_view() -> None:
    def limit_mps(*seen: bool) -> float:
        adapter = NavAdapter(AwarenessPolicy(), ROBOT)
        for step, shows in enumerate(seen):
            stamp_s = 0.05 * step
            aware = person(stamp_s, position=(2.5, 0.0), awareness_lower=0.95)
            tracks = [aware] if shows else []
            found = adapter.update(tracks, robot_at(stamp_s, speed_mps=0.5), stamp_s)
        return found.speed_limit_mps

    unaware_mps = limit_mps(True)
    assert limit_mps(True, False, False, True) == pytest.approx(unaware_mps, abs=0.02)
    assert limit_mps(True, True, True, True, True) > unaware_mps + 0.2
