"""The life of a track: initiation at any frame rate, confirmation, coasting, deletion, ids."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, as_bytes, nearest, observe

from perception import PersonObservation
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


@pytest.mark.parametrize("missed", [(), (1,), (2, 4)])
def test_a_person_who_is_missed_now_and_then_is_still_confirmed(missed) -> None:
    tracker = PersonTracker()
    for step in range(4 + 2 * len(missed)):
        now = step * PERIOD_S
        seen = [] if step in missed else [observe((3.0, 0.0), now)]
        (track,) = tracker.update(seen, now, CAMERA)
    assert (track.id, track.status) == (1, "confirmed")


def test_hits_too_far_apart_confirm_no_track() -> None:
    """One detection in four frames at one place is not enough for a person."""
    tracker = PersonTracker()
    for step in range(60):
        now = step * PERIOD_S
        tracker.update([observe((3.0, 0.0), now)] if step % 4 == 0 else [], now, CAMERA)
        assert all(track.status == "tentative" for track in tracker.predict(now))


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


@pytest.mark.parametrize("period_s", [0.02, 0.2, 1.0])
def test_a_tentative_track_outlives_two_missed_frames_and_is_deleted_soon(period_s: float) -> None:
    tracker = PersonTracker()
    walk(tracker, 0, 1)
    kept = [len(tracker.update((), step * period_s, CAMERA)) for step in range(1, 10)]
    assert kept == [1, 1] + [0] * 7


def test_a_tentative_track_is_kept_while_no_frame_comes() -> None:
    """A planner ahead of a late camera must not lose the people of the last frame."""
    tracker = PersonTracker()
    walk(tracker, 0, 1)
    assert [track.status for track in tracker.predict(0.4)] == ["tentative"]
    assert tracker.predict(1.0) == ()
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


class RackEverywhere:
    """A view in which nobody needs to be seen."""

    def visibility(self, positions_odom_m: FloatArray, T_odom_camera: FloatArray) -> FloatArray:
        return np.zeros(len(positions_odom_m))


@pytest.mark.parametrize("hidden_s", [0.5, 2.5])
def test_a_walker_behind_a_rack_keeps_the_id(hidden_s: float) -> None:
    rng = np.random.default_rng(17)
    kept, trials = 0, 10
    for _ in range(trials):
        tracker = PersonTracker(view=RackEverywhere())
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
@pytest.mark.parametrize("angle_rad", [np.pi / 3, np.pi])
def test_crossing_people_keep_their_ids(angle_rad: float, offset_m: float) -> None:
    rng = np.random.default_rng(23)
    kept, trials = 0, 6
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
    """With two people within reach of each other the variance of the noise counts twice."""
    spreads = {}
    for variance_m2, apart_m in ((0.03, 0.26), (0.03, 3.0), (0.06, 3.0)):
        tracker = PersonTracker()
        for step in range(20):
            now = step * PERIOD_S
            noise_m2 = 0.03 if step < 2 else variance_m2
            pair = [observe((3.0, y_m), now, covariance_odom_m2=noise_m2) for y_m in (0.0, apart_m)]
            tracks = tracker.update(pair, now, CAMERA)
        spreads[variance_m2, apart_m] = np.trace(tracks[0].covariance_odom)
    assert spreads[0.03, 0.26] > 1.4 * spreads[0.03, 3.0]
    assert spreads[0.03, 0.26] == pytest.approx(spreads[0.06, 3.0], rel=0.05)


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


RATES_HZ = (1.0, 2.5, 10.0, 30.0)
NOISE_STD_M, MISSED = 0.15, 0.1


def frames_until_confirmed(rate_hz: float, rng: np.random.Generator) -> int:
    """Return the number of frames, from the first that shows a walker until the confirming one."""
    tracker, heading = PersonTracker(), rng.uniform(-math.pi, math.pi)
    velocity = rng.uniform(0.0, 1.6) * np.array([math.cos(heading), math.sin(heading)])
    first = None
    for step in range(200):
        now = step / rate_hz
        place = np.array([5.0, 0.0]) + velocity * now + rng.normal(0.0, NOISE_STD_M, 2)
        people = [observe(place, now, covariance_odom_m2=NOISE_STD_M**2)]
        seen = rng.random() >= MISSED
        first = step if first is None and seen else first
        tracks = tracker.update(people if seen else [], now, CAMERA)
        if any(track.status == "confirmed" for track in tracks):
            assert first is not None
            return step - first + 1
    raise AssertionError("never confirmed")


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_people_are_confirmed_in_time_at_any_frame_rate(rate_hz: float) -> None:
    rng = np.random.default_rng(3)
    frames = [frames_until_confirmed(rate_hz, rng) for _ in range(40)]
    # The first frame is at 0 s, so n frames take n − 1 intervals.
    assert (np.median(frames) - 1) / rate_hz <= max(0.4, 2.0 / rate_hz)
    if rate_hz <= 10.0:
        assert np.quantile(frames, 0.9) <= 5


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_clutter_confirms_hardly_any_track_at_any_frame_rate(rate_hz: float) -> None:
    """0.01 false detections per square metre and frame in a hall of 64 m²."""
    rng, tracker, confirmed = np.random.default_rng(5), PersonTracker(), set()
    for step in range(300):
        now = step / rate_hz
        places = rng.uniform((0.0, -4.0), (8.0, 4.0), (rng.poisson(0.64), 2))
        frame = [observe(each, now, covariance_odom_m2=NOISE_STD_M**2) for each in places]
        tracks = tracker.update(frame, now, CAMERA)
        confirmed |= {track.id for track in tracks if track.status != "tentative"}
    assert len(confirmed) <= 1.0 + 300 / rate_hz / 30.0  # two a minute, and one by chance


def test_more_evidence_confirms_later() -> None:
    """The hits that confirm never become fewer when ``confirm_logit`` grows."""
    needed = []
    for logit in (-5.0, 0.0, 2.0, 5.0, 8.0, 20.0):
        tracker = PersonTracker(TrackerConfig(confirm_logit=logit))
        for hits in range(1, 20):
            now = 0.2 * hits
            (track,) = tracker.update([observe((5.0, 0.3 * now), now)], now, CAMERA)
            if track.status == "confirmed":
                break
        needed.append(hits)
    assert needed == sorted(needed)
    assert needed[0] == 2  # the first detection alone is no evidence against clutter
    assert needed[-1] > 4


@pytest.mark.parametrize("rate_hz", [1.0, 2.0])
def test_a_walker_keeps_one_id_at_a_low_frame_rate(rate_hz: float) -> None:
    """Between two frames a person walks further than ``gate_distance_m``."""
    for speed_mps in (0.0, 1.2, 1.8):
        tracker, ids = PersonTracker(), set()
        for step in range(20):
            now = step / rate_hz
            tracks = tracker.update([observe((speed_mps * now, 0.0), now)], now, CAMERA)
            ids |= {track.id for track in tracks}
        assert ids == {1}


def person(stamp_s: float, score: float, x_m: float = 5.0) -> PersonObservation:
    one = observe((x_m, 0.5 * stamp_s), stamp_s, awareness=0.9, awareness_std=0.05)
    return replace(one, score=score)


def feed(tracker: PersonTracker, frame: int, *scores: float) -> tuple[PersonTrack, ...]:
    stamp_s = frame * PERIOD_S
    return tracker.update([person(stamp_s, score) for score in scores], stamp_s, CAMERA)


def test_weak_detections_continue_a_track_and_are_no_evidence_of_awareness() -> None:
    tracker = PersonTracker()
    for frame in range(20):
        (before,) = feed(tracker, frame, 0.9)
    for frame in range(20, 120):  # twice as long as a track coasts
        (track,) = feed(tracker, frame, 0.2)
        assert (track.id, track.status, track.time_since_seen_s) == (1, "confirmed", 0.0)
    assert np.allclose(track.position_odom_m, (5.0, 0.5 * 119 * PERIOD_S), atol=0.05)
    assert before.awareness_lower > 0.5
    assert track.awareness_lower < 0.1


def test_a_weak_detection_takes_no_track_from_a_strong_one() -> None:
    tracker = PersonTracker()
    for frame in range(20):
        feed(tracker, frame, 0.9)
    stamp_s = 20 * PERIOD_S
    weak, strong = person(stamp_s, 0.1), person(stamp_s, 0.9, x_m=5.2)
    (track,) = tracker.update([weak, strong], stamp_s, CAMERA)
    assert track.position_odom_m[0] > 5.02


def test_weak_detections_neither_start_nor_confirm_a_track() -> None:
    assert [feed(PersonTracker(), frame, 0.2) for frame in range(3)] == [()] * 3
    tracker = PersonTracker()
    feed(tracker, 0, 0.9)
    for frame in range(1, 20):
        assert all(track.status == "tentative" for track in feed(tracker, frame, 0.2))
    assert feed(tracker, 40, 0.2) == ()


def test_a_faster_camera_confirms_no_more_clutter_a_second() -> None:
    """The evidence that is needed grows as the logarithm of the frame rate."""
    needed = {}
    for period_s in (0.2, 0.4):
        config = TrackerConfig(confirm_logit=15.0)
        while True:
            tracker = PersonTracker(config)
            tracker.update([observe((3.0, 0.0), 0.0)], 0.0, CAMERA)
            (track,) = tracker.update([observe((3.0, 0.0), period_s)], period_s, CAMERA)
            if track.status == "confirmed":
                break
            config = config.model_copy(update={"confirm_logit": config.confirm_logit - 0.01})
        needed[period_s] = config.confirm_logit
    # Twice as many tracks of clutter a second: each is confirmed half as often.
    assert needed[0.4] < needed[0.2] + 1.0


def test_somebody_whose_place_is_hardly_known_keeps_one_id() -> None:
    """Such a detection may as well be clutter; it is no evidence against the person, though."""
    tracker = PersonTracker()
    ids = set()
    for step in range(60):
        now = step * PERIOD_S
        (track,) = tracker.update([observe((9.0, 0.0), now, covariance_odom_m2=25.0)], now, CAMERA)
        ids.add(track.id)
    assert ids == {1}
