"""Births at any frame rate: people are confirmed in time, clutter is not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tracking_scenes import CAMERA, observe

from tracking import PersonTracker, TrackerConfig

RATES_HZ = (1.0, 2.0, 2.5, 5.0, 10.0, 20.0, 30.0)
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
    frames = [frames_until_confirmed(rate_hz, rng) for _ in range(60)]
    # The first frame is at 0 s, so n frames take n − 1 intervals.
    assert (np.median(frames) - 1) / rate_hz <= max(0.4, 2.0 / rate_hz)
    if rate_hz <= 10.0:
        assert np.quantile(frames, 0.9) <= 5


@pytest.mark.parametrize("rate_hz", RATES_HZ)
def test_clutter_confirms_hardly_any_track_at_any_frame_rate(rate_hz: float) -> None:
    """0.01 false detections per square metre and frame in a hall of 64 m²."""
    rng, tracker, confirmed = np.random.default_rng(5), PersonTracker(), set()
    for step in range(400):
        now = step / rate_hz
        places = rng.uniform((0.0, -4.0), (8.0, 4.0), (rng.poisson(0.64), 2))
        frame = [observe(each, now, covariance_odom_m2=NOISE_STD_M**2) for each in places]
        tracks = tracker.update(frame, now, CAMERA)
        confirmed |= {track.id for track in tracks if track.status != "tentative"}
    assert len(confirmed) <= 1.0 + 400 / rate_hz / 30.0  # two a minute, and one by chance


def test_more_evidence_confirms_later() -> None:
    """The hits that confirm never become fewer when ``confirm_logit`` grows."""
    needed = []
    for logit in (-5.0, 0.0, 2.0, 5.0, 8.0, 100.0):
        tracker = PersonTracker(TrackerConfig(confirm_logit=logit))
        for hits in range(1, 9):
            now = 0.2 * hits
            (track,) = tracker.update([observe((5.0, 0.3 * now), now)], now, CAMERA)
            if track.status == "confirmed":
                break
        needed.append(hits)
    assert needed == sorted(needed)
    assert needed[0] == 2  # the first detection alone is no evidence against clutter
    assert needed[-1] == TrackerConfig().confirm_hits


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


def test_one_missed_frame_does_not_change_the_frame_rate_for_long() -> None:
    """A pause of the camera counts as two intervals at most."""
    tracker = PersonTracker()
    for step in range(40):
        tracker.update((), 0.05 * step, CAMERA)
    now = 10.0
    (track,) = tracker.update([observe((5.0, 0.0), now)], now, CAMERA)
    for step in (1, 2):
        tracker.update((), now + 0.05 * step, CAMERA)
    tracks = tracker.update((), now + 0.2, CAMERA)
    assert [each.id for each in tracks] != [track.id]
