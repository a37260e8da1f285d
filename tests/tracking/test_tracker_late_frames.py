"""Frames that come out of order: processed as if they had come in order, or refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, as_bytes, camera_at, observe

from perception import Camera, PersonObservation
from tracking import CameraView, PersonTrack, PersonTracker, TrackerConfig, TrackingError

LAG_S = TrackerConfig().max_lag_s

Frame = tuple[float, list[PersonObservation], FloatArray]


def make_frames(seed: int, frames: int = 60, *, repeats: bool = False) -> list[Frame]:
    """Return frames of three walkers and clutter from a turning camera, in order of stamps."""
    rng = np.random.default_rng(seed)
    starts = rng.uniform((2.0, -2.0), (6.0, 2.0), (3, 2))
    velocities = rng.normal(0.0, 0.8, (3, 2))
    now, frame_list = 0.0, []
    for _ in range(frames):
        now += float(rng.choice([0.0, PERIOD_S] if repeats else [0.02, PERIOD_S, 0.12]))
        T = camera_at(0.2 * now, 0.0, 0.3 * np.sin(now))
        places = starts + velocities * now + rng.normal(0.0, 0.05, (3, 2))
        places = [place for place in places if rng.uniform() < 0.85]
        if rng.uniform() < 0.2:
            places.append(rng.uniform((1.0, -3.0), (7.0, 3.0)))
        people = [
            observe(
                place,
                now,
                T_odom_camera=T,
                covariance_odom_m2=0.0025,
                awareness=float(rng.uniform()) if rng.uniform() < 0.7 else None,
            )
            for place in places
        ]
        frame_list.append((now, people, T))
    return frame_list


def play(tracker: PersonTracker, frames: list[Frame]) -> tuple[PersonTrack, ...]:
    tracks: tuple[PersonTrack, ...] = ()
    for now, people, T in frames:
        tracks = tracker.update(people, now, T)
    return tracks


def delayed(frames: list[Frame], rng: np.random.Generator, share: float = 1.0) -> list[Frame]:
    """Return the frames in the order of arrival, with random latencies within the lag."""
    arrivals_s = [now + share * LAG_S * rng.uniform() for now, *_ in frames]
    return [frames[i] for i in sorted(range(len(frames)), key=lambda i: arrivals_s[i])]


@pytest.mark.parametrize("has_view", [False, True])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_frames_shuffled_within_the_lag_give_the_tracks_of_frames_in_order(
    has_view: bool, seed: int
) -> None:
    frames = make_frames(seed)
    view = CameraView(Camera.from_fov(640, 480, 1.2)) if has_view else None
    shuffled = delayed(frames, np.random.default_rng(seed + 1))
    in_order, late = PersonTracker(view=view), PersonTracker(view=view)
    expected, got = play(in_order, frames), play(late, shuffled)
    assert [track.id for track in expected] == [track.id for track in got]
    assert as_bytes(expected) == as_bytes(got)
    assert late.last_stamp_s == frames[-1][0]
    assert late.refused_late_frames == 0


@pytest.mark.parametrize("seed", range(5))
def test_frames_with_the_same_stamp_keep_their_order_of_arrival(seed: int) -> None:
    frames = make_frames(seed, 40, repeats=True)
    rng = np.random.default_rng(seed)
    latency = {now: LAG_S * rng.uniform() for now, *_ in frames}
    shuffled = sorted(frames, key=lambda frame: frame[0] + latency[frame[0]])
    assert as_bytes(play(PersonTracker(), frames)) == as_bytes(play(PersonTracker(), shuffled))


def test_a_late_frame_returns_the_tracks_of_the_latest_stamp() -> None:
    tracker = PersonTracker()
    tracker.update([observe((3.0, 0.0), 1.0)], 1.0, CAMERA)
    (track,) = tracker.update([observe((3.0, 0.0), 0.9)], 0.9, CAMERA)
    assert track.stamp_s == tracker.last_stamp_s == 1.0
    assert track.id == 1


def test_a_late_frame_can_show_that_a_new_person_is_a_known_one() -> None:
    def seen(tracker: PersonTracker, x_m: float, now: float) -> tuple[PersonTrack, ...]:
        return tracker.update([observe((x_m, 0.0), now)], now, CAMERA)

    tracker = PersonTracker()
    seen(tracker, 3.0, 0.0)
    # 1.4 m is outside the gate and starts a new track, until the frame in between comes.
    assert {track.id for track in seen(tracker, 4.4, 0.4)} == {1, 2}
    assert {track.id for track in seen(tracker, 3.7, 0.2)} == {1}


def test_a_frame_that_is_too_late_is_refused_and_counted_and_changes_nothing() -> None:
    tracker, twin = PersonTracker(), PersonTracker()
    frames = make_frames(3)
    play(tracker, frames[:40])
    play(twin, frames[:40])
    last_s = frames[39][0]
    for count in (1, 2):
        late_s = last_s - LAG_S - 1e-6 * count
        with pytest.raises(TrackingError, match=r"at most max_lag_s = 0\.5 s late"):
            tracker.update([observe((3.0, 0.0), late_s)], late_s, CAMERA)
        assert tracker.refused_late_frames == count
    assert as_bytes(play(tracker, frames[40:])) == as_bytes(play(twin, frames[40:]))
    edge_s = frames[-1][0] - LAG_S
    tracker.update([], edge_s, CAMERA)
    assert tracker.refused_late_frames == 2


def test_with_a_lag_of_zero_every_earlier_frame_is_too_late() -> None:
    tracker = PersonTracker(TrackerConfig(max_lag_s=0.0))
    tracker.update([], 1.0, CAMERA)
    tracker.update([], 1.0, CAMERA)
    with pytest.raises(TrackingError, match=r"at most max_lag_s = 0 s late"):
        tracker.update([], 1.0 - 1e-9, CAMERA)


def test_a_frame_before_the_first_one_may_be_late_too() -> None:
    first, second = make_frames(8)[:2]
    tracker, twin = PersonTracker(), PersonTracker()
    assert as_bytes(play(tracker, [second, first])) == as_bytes(play(twin, [first, second]))


def test_a_view_that_fails_changes_nothing() -> None:
    class Failing:
        fails = False

        def visibility(self, positions_odom_m: FloatArray, _T: FloatArray) -> FloatArray:
            return np.full(len(positions_odom_m), np.nan if self.fails else 1.0)

    view = Failing()
    tracker, twin = PersonTracker(view=view), PersonTracker(view=view)
    frames = make_frames(4)
    play(tracker, frames[:40])
    play(twin, frames[:40])
    view.fails = True
    late_s = frames[36][0] + 1e-3
    with pytest.raises(TrackingError, match=r"one number in \[0, 1\] per position"):
        tracker.update([], late_s, CAMERA)
    view.fails = False
    assert as_bytes(play(tracker, frames[40:])) == as_bytes(play(twin, frames[40:]))


def test_the_history_is_bounded_at_any_frame_rate() -> None:
    tracker = PersonTracker()
    for step in range(400):
        tracker.update([observe((3.0, 0.0), 1e-4 * step)], 1e-4 * step, CAMERA)
    with pytest.raises(TrackingError, match="more than the 256 frames"):
        tracker.update([], 0.01, CAMERA)
    tracker.update([], 0.039, CAMERA)
