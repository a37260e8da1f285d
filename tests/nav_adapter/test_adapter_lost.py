"""Lost people: when they are dropped out of sight, the limit rises slowly."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import (
    ROBOT,
    T_ODOM_CAMERA,
    finite,
    numbers,
    observed,
    person,
    policy_radius_m,
    robot_at,
)

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.policies import TimeBehaviour
from perception import Camera
from perception.laser import LaserScan, RobotMotion, Scanner, scan_points
from tracking import (
    CameraView,
    PersonTrack,
    PersonTracker,
    ScannerView,
    SensorConfig,
    TrackerConfig,
)

PERIOD_S = 0.05
POLICY = AwarenessPolicy()
RISE_MPS2 = 0.7
MAXIMUM_MPS = ROBOT.max_speed_mps


def with_rise(rise_mps2: float | None, **timing: float) -> AwarenessPolicy:
    return AwarenessPolicy(timing=TimeBehaviour(lost_rise_mps2=rise_mps2, **timing))


def lose(
    adapter: NavAdapter, seconds: float, *, coasting_s: float = 3.0, place_empty: bool = False
) -> list[NavConstraints]:
    """Show somebody 2 m ahead for 1 s, report them as coasting, then no more."""
    results = []
    for step in range(round((1.0 + coasting_s + seconds) / PERIOD_S)):
        now = step * PERIOD_S
        unseen_s = max(0.0, now - 1.0)
        track = person(
            now,
            position=(2.0, 0.0),
            status="coasting" if unseen_s else "confirmed",
            sigma_m=0.05 + 0.1 * unseen_s,
            unseen_s=unseen_s,
        )
        tracks = (replace(track, place_empty=place_empty),) if unseen_s <= coasting_s else ()
        results.append(adapter.update(tracks, robot_at(now), now, perception_stamp_s=now))
    return results


def test_the_limit_rises_from_where_it_was_at_the_rate_of_the_policy() -> None:
    results = lose(NavAdapter(POLICY, ROBOT), 3.0)
    after = [each for each in results if each.stamp_s > 4.0 + 1e-6]
    assert all(each.obstacles == () for each in after)
    last = results[-len(after) - 1]
    assert last.speed_limit_mps < 0.5
    for before, each in pairwise([last, *after]):
        rise_mps = each.speed_limit_mps - before.speed_limit_mps
        if each.speed_limit_mps < MAXIMUM_MPS:
            assert rise_mps == pytest.approx(RISE_MPS2 * PERIOD_S, abs=1e-6)
            assert each.limited_by == "track 1: lost"
        else:
            assert rise_mps <= RISE_MPS2 * PERIOD_S + 1e-6
    assert after[-1].speed_limit_mps == MAXIMUM_MPS
    assert after[-1].limited_by == "robot maximum"


@settings(max_examples=30)
@given(st.floats(1.0, 7.0), st.floats(-math.pi, math.pi))
def test_no_limit_of_a_robot_that_stands_jumps_when_somebody_is_dropped(away_m, bearing_rad):
    nav = NavAdapter(POLICY, ROBOT)
    place_m = away_m * np.array([math.cos(bearing_rad), math.sin(bearing_rad)])
    lowest = []
    for step in range(70):
        now = step * PERIOD_S
        tracks = [person(now, position=place_m)] if now < 1.0 else []
        each = nav.update(tracks, robot_at(now), now, perception_stamp_s=now)
        other_mps = min(each.other_way_limit_mps, MAXIMUM_MPS)
        lowest.append(min(each.speed_limit_mps, other_mps))
    assert max(b - a for a, b in pairwise(lowest[21:])) <= RISE_MPS2 * PERIOD_S + 1e-6


def test_somebody_lost_at_stamp_0_lets_the_limit_rise_too() -> None:
    nav = NavAdapter(with_rise(0.5, hold_s=0.0), ROBOT)
    nav.update([person(position=(2.0, 0.0))], robot_at(), 0.0, perception_stamp_s=0.0)
    limits = [
        nav.update([], robot_at(now), now, perception_stamp_s=now).speed_limit_mps
        for now in (0.1, 0.4, 0.7)
    ]
    assert limits[1] == pytest.approx(limits[0] + 0.15)
    assert limits[2] == pytest.approx(limits[0] + 0.30)


def test_a_robot_that_drives_away_from_a_lost_person_is_free_of_them() -> None:
    """Never slower than if the person were still held."""
    lost, held = NavAdapter(POLICY, ROBOT), NavAdapter(with_rise(0.7, hold_s=10.0), ROBOT)
    freed = False
    for step in range(80):
        now = step * PERIOD_S
        tracks = (person(now, position=(2.0, 0.0)),) if step < 10 else ()
        away = robot_at(now, position=(-1.2 * now, 0.0), heading_rad=np.pi, speed_mps=1.2)
        limits = [
            each.update(tracks, away, now, perception_stamp_s=now).speed_limit_mps
            for each in (lost, held)
        ]
        assert limits[0] >= limits[1]
        freed |= step > 10 and limits[0] == MAXIMUM_MPS
    assert freed


def test_who_is_back_or_shown_gone_or_was_lost_before_a_pause_is_not_lost_any_more() -> None:
    """The limits are those of a policy without the rule, with which they jump."""
    back = person(4.2, position=(4.0, 0.0))
    for seconds, people, now in ((0.2, (back,), 4.2), (0.0, (), 30.0)):
        adapters = NavAdapter(POLICY, ROBOT), NavAdapter(with_rise(None), ROBOT)
        for each in adapters:
            lose(each, seconds)
        one, other = (each.update(people, robot_at(now), now) for each in adapters)
        assert numbers(one) == numbers(other)
    gone = lose(NavAdapter(POLICY, ROBOT), 0.5, place_empty=True)
    plain = lose(NavAdapter(with_rise(None), ROBOT), 0.5)
    assert [numbers(one) for one in gone] == [numbers(one) for one in plain]
    limits = [each.speed_limit_mps for each in plain]
    assert max(after - before for before, after in pairwise(limits)) > 1.0
    assert limits[-1] == MAXIMUM_MPS


def test_a_track_that_was_never_more_than_tentative_is_not_lost() -> None:
    adapter = NavAdapter(POLICY, ROBOT)
    for step in range(4):
        now = step * PERIOD_S
        adapter.update((person(now, status="tentative"),), robot_at(now), now)
    assert adapter.update((), robot_at(0.3), 0.3).speed_limit_mps == MAXIMUM_MPS


def test_the_people_kept_are_bounded_by_those_of_the_last_seconds() -> None:
    adapter, sizes = NavAdapter(POLICY, ROBOT), []
    adapter.update((), robot_at(-0.1), -0.1)
    empty = len(pickle.dumps(adapter))
    for step in range(200):
        now = step * 0.1
        result = adapter.update((person(now, track_id=step),), robot_at(now), now)
        assert len(result.obstacles) <= 12  # the one in view and those of the last second
        if step % 20 == 19:
            sizes.append(len(pickle.dumps(adapter)))
    assert max(sizes[5:]) <= 1.02 * max(sizes[:5])
    for late_s in (1.1, 4.0, 7.0):  # the one before the last may have to be taken back
        after = adapter.update((), robot_at(now + late_s), now + late_s)
    assert after.obstacles == ()
    assert len(pickle.dumps(adapter)) <= 1.1 * empty


@given(
    walk=st.lists(
        st.tuples(st.sampled_from([0.05, 0.1, 0.3]), st.sets(st.integers(1, 3)), st.booleans()),
        min_size=1,
        max_size=40,
    ),
    places=st.lists(st.tuples(finite(0.8, 5.0), finite(-2.0, 2.0)), min_size=3, max_size=3),
)
def test_losing_people_is_between_holding_and_forgetting_them(walk, places) -> None:
    """Whoever comes and goes, where nobody moves: unaware people who stand before the robot."""
    policies = {"lost": POLICY, "forgotten": with_rise(None), "held": with_rise(0.7, hold_s=10.0)}
    adapters = {name: NavAdapter(policy, ROBOT) for name, policy in policies.items()}
    now, before_mps = 0.0, MAXIMUM_MPS
    for dt, there, seen_late in walk:
        now += dt
        unseen_s = 0.3 if seen_late else 0.0
        tracks = [
            person(now, track_id=k, position=places[k - 1], sigma_m=0.1, unseen_s=unseen_s)
            for k in sorted(there)
        ]
        limits = {
            name: each.update(tracks, robot_at(now), now, perception_stamp_s=now).speed_limit_mps
            for name, each in adapters.items()
        }
        assert limits["held"] - 1e-9 <= limits["lost"] <= limits["forgotten"] + 1e-9
        if not there:
            assert limits["lost"] - before_mps <= RISE_MPS2 * dt + 1e-6
        before_mps = limits["lost"]


def ended(period_s: float, tracker: PersonTracker, **scan: Any) -> tuple[PersonTrack, ...]:
    """Show somebody for 5 s, then an empty place; return the tracks before the last one ends."""
    latest: tuple[PersonTrack, ...] = ()
    for step in range(round(10.0 / period_s)):
        now = period_s * step
        seen = [observed(now, (3.0, 0.0))] if now < 5.0 else []
        tracks = tracker.update(seen, now, T_ODOM_CAMERA, **scan)
        assert not any(track.place_empty for track in tracks if track.status != "coasting")
        if latest and not tracks:
            assert now - 5.0 < 2.6
            return latest
        if tracks and 5.0 <= now <= 5.0 + 0.4 * 1.2 and period_s < 0.4:
            assert not tracks[0].place_empty
        latest = tracks
    pytest.fail("the track never ended")


@pytest.mark.parametrize("period_s", [0.1, 0.5])
def test_the_tracker_tells_before_it_ends_a_track_whose_place_is_empty(period_s: float) -> None:
    walls = LaserScan(0.0, -math.pi, math.radians(0.5), np.full(720, 8.0), 0.05, 20.0)
    at_origin = Scanner.mounted(0.0, 0.0, 0.2)
    points = scan_points(walls, at_origin, RobotMotion(0.0, np.eye(4)))
    tracker = PersonTracker(sensors={"laser": SensorConfig(view=ScannerView())})
    (track,) = ended(period_s, tracker, sensor="laser", view=ScannerView(10.0, points=points))
    assert track.place_empty
    # With a camera, or a scanner of which the ranges are unknown, the track ends as soon.
    tracker = PersonTracker(view=CameraView(Camera.from_fov(640, 480, math.radians(60.0))))
    (track,) = ended(period_s, tracker)
    assert not track.place_empty
    tracker = PersonTracker(sensors={"laser": SensorConfig(view=ScannerView(10.0))})
    (track,) = ended(period_s, tracker, sensor="laser")
    assert not track.place_empty


def watch(seconds: float, awareness: float) -> tuple[PersonTracker, NavAdapter, NavConstraints]:
    tracker = PersonTracker(TrackerConfig(awareness=POLICY.filter))
    adapter = NavAdapter(POLICY, ROBOT)
    for step in range(round(seconds / PERIOD_S)):
        now = step * PERIOD_S
        tracks = tracker.update((observed(now, (3.0, 0.0), awareness),), now, T_ODOM_CAMERA)
        result = adapter.update(tracks, robot_at(now), now)
    return tracker, adapter, result


LOSSES: dict[str, Callable[[PersonTracker, float], tuple[PersonTrack, ...]]] = {
    "predict": lambda tracker, now: tracker.predict(now),
    "empty frames": lambda tracker, now: tracker.update((), now, T_ODOM_CAMERA),
}


@pytest.mark.parametrize("seen_s", [0.1, 0.6, 3.0])
@pytest.mark.parametrize("loss", [*LOSSES, "repeated tracks"])
def test_losing_the_camera_for_a_second_never_shrinks_a_radius(loss: str, seen_s: float) -> None:
    tracker, adapter, before = watch(seen_s, 0.95)
    lost = before.stamp_s
    last_tracks = tracker.predict(lost)
    for step in range(1, round(1.0 / PERIOD_S) + 1):
        now = lost + step * PERIOD_S
        tracks = LOSSES[loss](tracker, now) if loss in LOSSES else last_tracks
        after = adapter.update(tracks, robot_at(now), now)
        for a in before.obstacles:
            # A person seen only for a moment may be dropped, but must not shrink.
            for b in (o for o in after.obstacles if o.track_id == a.track_id):
                assert b.radius_m >= a.radius_m
                assert b.awareness_lower <= a.awareness_lower
        if seen_s > 0.15:
            assert len(after.obstacles) == 1
        before = after
    assert all(o.radius_m >= policy_radius_m(POLICY, 0.0) for o in before.obstacles)


def test_an_attentive_person_lets_the_robot_pass_faster_and_nearer_than_a_distracted_one() -> None:
    attentive, distracted = watch(3.0, 0.95)[2], watch(3.0, 0.0)[2]
    assert attentive.obstacles[0].awareness_lower > POLICY.inflation.aware_above
    nearer_m = policy_radius_m(POLICY, 0.0) - policy_radius_m(POLICY, 1.0)
    assert attentive.obstacles[0].radius_m < distracted.obstacles[0].radius_m - 0.9 * nearer_m
    assert attentive.speed_limit_mps > 1.3 * distracted.speed_limit_mps
    assert distracted.limited_by == "track 1: reach"
