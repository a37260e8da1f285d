"""The life of a track: initiation, confirmation, coasting, deletion, and stable ids."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, as_bytes, nearest, observe

from tracking import PersonTrack, PersonTracker, TrackerConfig

CONFIG = TrackerConfig()


def walk(
    tracker: PersonTracker, first: int, last: int, *, period_s: float = PERIOD_S
) -> tuple[PersonTrack, ...]:
    """Show one walker at 1.2 m/s in the frames from ``first`` to ``last`` − 1."""
    tracks: tuple[PersonTrack, ...] = ()
    for step in range(first, last):
        now = step * period_s
        tracks = tracker.update([observe((3.0 + 1.2 * now, 0.0), now)], now, CAMERA)
    return tracks


@pytest.mark.parametrize("period_s", [0.03, 0.05, 0.4, 0.8])
@pytest.mark.parametrize("hits", [1, 3, 4])
def test_confirm_hits_frames_confirm_at_any_rate(period_s: float, hits: int) -> None:
    """Without evidence that could confirm sooner."""
    tracker = PersonTracker(TrackerConfig(confirm_hits=hits, confirm_logit=100.0))
    statuses = [walk(tracker, k, k + 1, period_s=period_s)[0].status for k in range(hits + 1)]
    assert statuses == ["tentative"] * (hits - 1) + ["confirmed"] * 2


@pytest.mark.parametrize("missed", [(), (1,), (2, 4)])
def test_a_person_who_is_missed_now_and_then_is_still_confirmed(
    missed: tuple[int, ...],
) -> None:
    tracker = PersonTracker()
    for step in range(CONFIG.confirm_hits + len(missed)):
        now = step * PERIOD_S
        seen = [] if step in missed else [observe((3.0, 0.0), now)]
        (track,) = tracker.update(seen, now, CAMERA)
    assert (track.id, track.status) == (1, "confirmed")


def test_hits_too_far_apart_confirm_no_track() -> None:
    """One detection in four frames at one place is not enough for a person."""
    tracker = PersonTracker(TrackerConfig(max_tentative_gap_s=1.0))
    for step in range(60):
        now = step * PERIOD_S
        tracker.update([observe((3.0, 0.0), now)] if step % 4 == 0 else [], now, CAMERA)
        assert all(track.status == "tentative" for track in tracker.predict(now))


def test_clutter_alone_confirms_hardly_any_track() -> None:
    rng = np.random.default_rng(5)
    tracker, confirmed = PersonTracker(), set()
    for step in range(1000):
        now = step * PERIOD_S
        # 0.03 false detections per square metre and frame, three times the density assumed.
        places = rng.uniform((0.0, -4.0), (8.0, 4.0), (rng.poisson(0.03 * 64), 2))
        tracks = tracker.update([observe(place, now) for place in places], now, CAMERA)
        confirmed |= {track.id for track in tracks if track.status != "tentative"}
    assert len(confirmed) <= 5  # of about 1900 false detections


def test_a_repeated_frame_confirms_no_track() -> None:
    tracker = PersonTracker()
    for _ in range(10):
        (track,) = walk(tracker, 0, 1)
    assert track.status == "tentative"


def test_a_second_frame_with_the_same_stamp_is_a_second_measurement() -> None:
    tracker = PersonTracker()
    walk(tracker, 0, 20)
    (before,) = tracker.predict(19 * PERIOD_S)
    (after,) = walk(tracker, 19, 20)
    assert after.id == before.id
    assert np.trace(after.covariance_odom) < np.trace(before.covariance_odom)
    (unseen,) = tracker.update((), 19 * PERIOD_S, CAMERA)
    # Another camera that does not see the person changes nothing.
    assert as_bytes([unseen]) == as_bytes([after])


def test_an_unseen_person_coasts_and_is_deleted_after_max_coast_s() -> None:
    tracker = PersonTracker()
    walk(tracker, 0, 20)
    last_s, previous = 19 * PERIOD_S, tracker.predict(19 * PERIOD_S)[0]
    for step in range(1, 200):
        now = last_s + step * PERIOD_S
        tracks = tracker.update((), now, CAMERA)
        if now - last_s > CONFIG.max_coast_s:
            assert tracks == ()
            break
        (track,) = tracks
        assert track.status == "coasting"
        assert track.time_since_seen_s == pytest.approx(now - last_s)
        np.testing.assert_allclose(track.velocity_odom_mps, previous.velocity_odom_mps)
        np.testing.assert_allclose(
            track.position_odom_m,
            previous.position_odom_m + PERIOD_S * previous.velocity_odom_mps,
            atol=1e-9,
        )
        growth = track.covariance_odom - previous.covariance_odom
        assert np.linalg.eigvalsh(growth[:2, :2])[0] > 0.0
        previous = track
    assert now - last_s == pytest.approx(CONFIG.max_coast_s, abs=2 * PERIOD_S)


@pytest.mark.parametrize("period_s", [0.02, 0.05, 0.2, 1.0])
def test_a_tentative_track_outlives_two_missed_frames_and_is_deleted_soon(period_s: float) -> None:
    tracker = PersonTracker()
    walk(tracker, 0, 1)
    kept = [len(tracker.update((), step * period_s, CAMERA)) for step in range(1, 10)]
    deleted_s = period_s * (kept.index(0) + 1)
    least_s = max(CONFIG.max_tentative_gap_s, 2.0 * period_s)
    assert least_s < deleted_s <= least_s + period_s + 1e-9
    assert not any(kept[kept.index(0) :])


def test_a_tentative_track_is_kept_while_no_frame_comes() -> None:
    """A planner ahead of a late camera must not lose the people of the last frame."""
    tracker = PersonTracker()
    walk(tracker, 0, 1)
    assert [track.status for track in tracker.predict(0.4)] == ["tentative"]
    assert tracker.predict(CONFIG.confirm_window_s + 0.01) == ()
    assert len(walk(tracker, 9, 10)) == 1


def test_after_a_long_pause_everyone_is_new() -> None:
    tracker = PersonTracker(TrackerConfig(max_pause_s=1e6))
    (before,) = walk(tracker, 0, 20)
    now = 1e6
    (after,) = tracker.update([observe(before.position_odom_m, now)], now, CAMERA)
    assert after.id != before.id
    assert after.status == "tentative"
    assert tracker.predict(1e300) == ()


@pytest.mark.parametrize(("gap_s", "same"), [(2.9, True), (3.1, False)])
def test_a_person_at_the_place_of_one_lost_too_long_ago_is_new(gap_s: float, same: bool) -> None:
    tracker = PersonTracker()
    for step in range(20):
        now = step * PERIOD_S
        (before,) = tracker.update([observe((3.0, 0.0), now)], now, CAMERA)
    now += gap_s
    (after,) = tracker.update([observe((3.0, 0.0), now)], now, CAMERA)
    assert (after.id == before.id) == same


@pytest.mark.parametrize("hidden_s", [0.5, 1.5, 2.5])
def test_a_walker_behind_a_rack_keeps_the_id(hidden_s: float) -> None:
    rng = np.random.default_rng(17)
    kept, trials = 0, 20
    for _ in range(trials):
        tracker = PersonTracker()
        heading = rng.uniform(-np.pi, np.pi)
        velocity = 1.2 * np.array([np.cos(heading), np.sin(heading)])
        ids = []
        for step in range(90):
            now = step * PERIOD_S
            hidden = 2.0 <= now < 2.0 + hidden_s
            place = np.array([4.0, 0.0]) + velocity * now + rng.normal(0.0, 0.05, 2)
            frame = [] if hidden else [observe(place, now, covariance_odom_m2=0.05**2)]
            ids.append([track.id for track in tracker.update(frame, now, CAMERA)])
        kept += ids[-1] == ids[39]
    assert kept >= 0.9 * trials


@pytest.mark.parametrize("offset_m", [0.1, 0.4])
@pytest.mark.parametrize("angle_rad", [np.pi / 3, np.pi / 2, np.pi])
def test_crossing_people_keep_their_ids(angle_rad: float, offset_m: float) -> None:
    rng = np.random.default_rng(23)
    kept, trials = 0, 15
    headings = np.array([[1.0, 0.0], [np.cos(angle_rad), np.sin(angle_rad)]])
    side = np.array([0.0, offset_m]) if angle_rad == np.pi else np.array([offset_m, 0.0])
    for _ in range(trials):
        tracker = PersonTracker()
        for step in range(81):
            now = step * PERIOD_S
            places = np.array([6.0, 0.0]) + 1.2 * (now - 2.0) * headings
            places[1] += side
            seen = places + rng.normal(0.0, 0.05, (2, 2))
            frame = [observe(place, now, covariance_odom_m2=0.05**2) for place in seen]
            tracks = tracker.update(frame, now, CAMERA)
            if step == 10:
                before = [nearest(tracks, place).id for place in places]
        kept += [nearest(tracks, place).id for place in places] == before
    assert kept == trials


def test_an_ambiguous_match_has_less_weight() -> None:
    """With two people within reach of each other the covariance is larger."""
    spreads = {}
    for factor in (1.0, 3.0):
        tracker = PersonTracker(TrackerConfig(ambiguous_noise_factor=factor, max_pause_s=1e3))
        for apart_m in (0.05, 3.0):
            for step in range(20):
                now = step * PERIOD_S + 100.0 * apart_m
                pair = [observe((3.0, y_m), now) for y_m in (0.0, apart_m)]
                tracks = tracker.update(pair, now, CAMERA)
            spreads[factor, apart_m] = np.trace(tracks[0].covariance_odom)
    assert spreads[3.0, 0.05] > 1.5 * spreads[1.0, 0.05]
    assert spreads[3.0, 3.0] == pytest.approx(spreads[1.0, 3.0])


def test_predict_returns_the_tracks_of_an_empty_frame() -> None:
    tracker = PersonTracker()
    walk(tracker, 0, 20)
    tracker.update([observe((8.0, 2.0), 1.0)], 1.0, CAMERA)
    for ahead_s in (0.0, 0.04, 0.3, 0.6, 2.5, 4.0):
        now = 1.0 + ahead_s
        before = as_bytes(tracker.predict(1.0))
        predicted = tracker.predict(now)
        assert as_bytes(tracker.predict(1.0)) == before
        shown = copy.deepcopy(tracker).update((), now, CAMERA)
        # Only frames delete a tentative track early, so it may be missing from the second.
        confirmed = [track for track in predicted if track.status != "tentative"]
        assert [t.id for t in confirmed] == [t.id for t in shown if t.status != "tentative"]
        for a, b in zip(confirmed, shown, strict=False):
            np.testing.assert_allclose(a.position_odom_m, b.position_odom_m, atol=1e-12)
            np.testing.assert_allclose(a.covariance_odom, b.covariance_odom, atol=1e-12)
            assert (a.awareness, a.awareness_std) == (b.awareness, b.awareness_std)
            assert a.awareness_lower == b.awareness_lower
            assert a.time_since_seen_s == b.time_since_seen_s


people = st.lists(
    st.tuples(
        st.sampled_from([0.0, 0.1, 0.3, 1.0, 5.0]),
        st.sampled_from([0.0, 0.2, -1.0]),
        st.sampled_from([0.0, 1e-4, 0.02, 4.0]),
        st.sampled_from([None, 0.0, 0.5, 1.0]),
        st.sampled_from([0.0, 0.05, 0.25, 2.0]),
    ),
    max_size=5,
)
frames = st.lists(
    st.tuples(st.sampled_from([0.0, 1e-6, 0.03, 0.05, 0.05, 0.4, 2.0, 50.0]), people), max_size=25
)


@settings(max_examples=80)
@given(frames)
def test_the_tracks_are_valid_after_any_frames(sequence: list[tuple[float, Any]]) -> None:
    tracker, now = PersonTracker(TrackerConfig(max_pause_s=100.0)), 0.0
    ever: set[int] = set()
    lower: dict[int, float] = {}
    alive: set[int] = set()
    for dt_s, seen in sequence:
        now += dt_s
        for track in tracker.predict(now):
            assert track.awareness_lower <= lower[track.id]
            lower[track.id] = track.awareness_lower
        observations = [
            observe(
                (x, y), now, covariance_odom_m2=variance, awareness=alpha, awareness_std=alpha_std
            )
            for x, y, variance, alpha, alpha_std in seen
        ]
        evidence = any(o.awareness is not None for o in observations)
        tracks = tracker.update(observations, now, CAMERA)
        ids = [track.id for track in tracks]
        assert ids == sorted(set(ids))
        # An id that was not in use is a new one.
        assert all(i > max(ever, default=0) for i in set(ids) - alive)
        # Observations have tracks.
        assert len([t for t in tracks if t.time_since_seen_s == 0.0]) >= bool(seen)
        for track in tracks:
            np.linalg.cholesky(track.covariance_odom)
            np.testing.assert_array_equal(track.covariance_odom, track.covariance_odom.T)
            assert 0.0 <= track.awareness_lower <= track.awareness <= 1.0
            assert track.awareness_std <= 0.5
            assert track.stamp_s == now
            if track.status == "tentative":
                assert track.awareness_lower == 0.0
            assert (track.time_since_seen_s == 0.0) or track.status != "confirmed"
            if not evidence and track.id in lower:
                assert track.awareness_lower <= lower[track.id]
            lower[track.id] = track.awareness_lower
        alive = set(ids)
        ever |= alive
    assert as_bytes(copy.deepcopy(tracker).predict(now)) == as_bytes(tracker.predict(now))
