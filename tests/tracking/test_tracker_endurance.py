"""Valid tracks and bounded memory for any input, however long."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import CAMERA, as_bytes, camera_at, observe

from perception import Camera
from tracking import CameraView, PersonTracker, TrackerConfig, TrackingError

VIEW = CameraView(Camera.from_fov(640, 480, 1.2))

# Clutter bursts, duplicates and people. There are few positions to draw from, so they coincide.
spots = st.tuples(
    st.sampled_from([1.0, 1.0, 1.2, 2.0, 2.5, 6.0]), st.sampled_from([-0.5, 0.0, 0.0, 0.3, 4.0])
)
crowds = st.lists(spots, max_size=6) | st.lists(spots, min_size=15, max_size=25)
steps_s = st.sampled_from([0.0, 0.0, 1e-9, 0.01, 0.05, 0.05, 0.3, 1.1, 4.0, 1e4, -0.02, -0.3, -2.0])
sequences = st.lists(st.tuples(steps_s, crowds), max_size=30)


@pytest.mark.parametrize("view", [None, VIEW], ids=["no view", "view"])
@settings(max_examples=50, deadline=None)
@given(sequence=sequences)
def test_the_tracks_are_valid_after_any_sequence(
    view: Any, sequence: list[tuple[float, Any]]
) -> None:
    tracker = PersonTracker(TrackerConfig(max_pause_s=1e12, new_clock_after_s=1e5), view=view)
    latest = 0.0
    for dt_s, crowd in sequence:
        now = latest + dt_s
        seen = [observe(spot, now, awareness=0.7) for spot in crowd]
        before, last_s = people_of(tracker), tracker.last_stamp_s
        refused = tracker.refused_late_frames
        try:
            tracks = tracker.update(seen, now, camera_at(yaw_rad=0.3 * dt_s))
        except TrackingError:
            assert now < latest - tracker.config.max_lag_s
            assert tracker.refused_late_frames == refused + 1
            assert (people_of(tracker), tracker.last_stamp_s) == (before, last_s)
            continue
        assert tracker.last_stamp_s == (now if last_s is None else max(latest, now))
        latest = tracker.last_stamp_s
        ids = [track.id for track in tracks]
        assert ids == sorted(set(ids))
        for track in tracks:
            np.testing.assert_array_equal(track.covariance_odom, track.covariance_odom.T)
            np.linalg.cholesky(track.covariance_odom)
            assert track.stamp_s == latest
            assert 0.0 <= track.awareness_lower <= track.awareness <= 1.0
            assert 0.0 <= track.awareness_std <= 0.5
            assert track.time_since_seen_s >= 0.0
            if track.status == "tentative":
                assert track.awareness_lower == 0.0


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_order_of_the_measurements_in_a_frame_does_not_matter(seed: int) -> None:
    """Only the ids of people who are first seen in one frame follow its order."""
    rng = np.random.default_rng(seed)
    first, second = PersonTracker(), PersonTracker()
    people = rng.uniform((1.0, -3.0), (7.0, 3.0), (6, 2))
    names: dict[int, int] = {}
    for step in range(25):
        now = 0.05 * step
        places = people + rng.normal(0.0, 0.1, people.shape)
        alphas = rng.uniform(size=6)
        frame = [
            observe(place, now, awareness=float(alpha))
            for place, alpha in zip(places, alphas, strict=True)
            if rng.uniform() < 0.9
        ]
        one = first.update(frame, now, CAMERA)
        shuffled = [frame[i] for i in rng.permutation(len(frame))]
        other = {
            track.position_odom_m.tobytes(): track for track in second.update(shuffled, now, CAMERA)
        }
        assert len(other) == len(one)
        for track in one:
            twin = other[track.position_odom_m.tobytes()]
            assert names.setdefault(track.id, twin.id) == twin.id
            assert as_bytes([track])[0][1:] == as_bytes([twin])[0][1:]


def people_of(tracker: PersonTracker) -> list[Any]:
    """Return every track at the tracker's latest stamp."""
    return as_bytes(tracker.predict(tracker.last_stamp_s or 0.0))


def state_size(tracker: PersonTracker) -> int:
    """Return the size of a tracker's memory, bytes."""
    return len(pickle.dumps(tracker))


@pytest.mark.parametrize("frames", [3_000, pytest.param(100_000, marks=pytest.mark.full)])
def test_memory_is_bounded_for_any_number_of_frames(frames: int) -> None:
    rng = np.random.default_rng(1)
    tracker = PersonTracker(TrackerConfig(max_lag_s=0.2), view=VIEW)
    sizes = []
    now = 0.0
    for step in range(frames):
        now += 0.03
        spots = [(3.0 + np.sin(0.3 * now), 0.5), *rng.uniform((1, -3), (7, 3), (rng.poisson(1), 2))]
        late_s = now - 0.15 if step % 7 == 3 else now
        tracker.update([observe(spot, late_s, awareness=0.5) for spot in spots], late_s, CAMERA)
        if step % (frames // 20) == frames // 20 - 1:
            sizes.append(state_size(tracker))
    assert max(sizes[10:]) < 1.5 * max(sizes[:10])
    assert np.mean(sizes[10:]) < 1.2 * np.mean(sizes[:10])
    assert max(sizes) < 300_000
