"""Weak detections continue confirmed tracks and never start one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tracking_scenes import CAMERA, PERIOD_S, observe

from perception import PersonObservation
from tracking import PersonTrack, PersonTracker, TrackerConfig


def person(stamp_s: float, score: float, x_m: float = 5.0) -> PersonObservation:
    one = observe((x_m, 0.5 * stamp_s), stamp_s, awareness=0.9, awareness_std=0.05)
    return replace(one, score=score)


def feed(tracker: PersonTracker, frame: int, *scores: float) -> tuple[PersonTrack, ...]:
    stamp_s = frame * PERIOD_S
    return tracker.update([person(stamp_s, score) for score in scores], stamp_s, CAMERA)


def test_weak_detections_never_start_a_track() -> None:
    tracker = PersonTracker()
    assert [feed(tracker, frame, 0.2) for frame in range(40)] == [()] * 40


def test_weak_detections_continue_a_track() -> None:
    tracker = PersonTracker()
    for frame in range(20):
        feed(tracker, frame, 0.9)
    for frame in range(20, 120):  # twice as long as a track coasts
        (track,) = feed(tracker, frame, 0.2)
        assert (track.id, track.status, track.time_since_seen_s) == (1, "confirmed", 0.0)
    assert np.allclose(track.position_odom_m, (5.0, 0.5 * 119 * PERIOD_S), atol=0.05)


def test_weak_detections_do_not_confirm_a_track() -> None:
    tracker = PersonTracker()
    feed(tracker, 0, 0.9)
    for frame in range(1, 20):
        assert all(track.status == "tentative" for track in feed(tracker, frame, 0.2))


def test_a_weak_detection_is_no_evidence_of_awareness() -> None:
    tracker = PersonTracker()
    for frame in range(20):
        (before,) = feed(tracker, frame, 0.9)
    for frame in range(20, 40):
        (after,) = feed(tracker, frame, 0.2)
    assert before.awareness_lower > 0.5
    assert after.awareness_lower < 0.1


def test_a_weak_detection_takes_no_track_from_a_strong_one() -> None:
    tracker = PersonTracker()
    for frame in range(20):
        feed(tracker, frame, 0.9)
    stamp_s = 20 * PERIOD_S
    weak, strong = person(stamp_s, 0.1), person(stamp_s, 0.9, x_m=5.2)
    (track,) = tracker.update([weak, strong], stamp_s, CAMERA)
    assert track.position_odom_m[0] > 5.02


def test_the_threshold_is_a_setting() -> None:
    tracker = PersonTracker(TrackerConfig(weak_score=0.0))
    for frame in range(20):
        (track,) = feed(tracker, frame, 0.01)
    assert track.status == "confirmed"
