"""Frames that come out of order count as if they had come in order, or are refused."""

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


def film(seed: int, frames: int = 60, *, repeats: bool = False) -> list[Frame]:
    """Three walkers and clutter in front of a camera that turns; stamps in order."""
    rng = np.random.default_rng(seed)
    starts = rng.uniform((2.0, -2.0), (6.0, 2.0), (3, 2))
    velocities = rng.normal(0.0, 0.8, (3, 2))
    now, shown = 0.0, []
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
        shown.append((now, people, T))
    return shown


def play(tracker: PersonTracker, frames: list[Frame]) -> tuple[PersonTrack, ...]:
    tracks: tuple[PersonTrack, ...] = ()
    for now, people, T in frames:
        tracks = tracker.update(people, now, T)
    return tracks


def delayed(frames: list[Frame], rng: np.random.Generator, share: float = 1.0) -> list[Frame]:
    """The frames in the order in which they come with latencies within the lag."""
    latest = [now + share * LAG_S * rng.uniform() for now, *_ in frames]
    return [frames[i] for i in sorted(range(len(frames)), key=lambda i: latest[i])]


@pytest.mark.parametrize("seen_view", [False, True])
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_frames_shuffled_within_the_lag_are_frames_in_order(seen_view: bool, seed: int) -> None:
    frames = film(seed)
    view = CameraView(Camera.from_fov(640, 480, 1.2)) if seen_view else None
    shuffled = delayed(frames, np.random.default_rng(seed + 1))
    in_order, late = PersonTracker(view=view), PersonTracker(view=view)
    expected, got = play(in_order, frames), play(late, shuffled)
    assert [track.id for track in expected] == [track.id for track in got]
    assert as_bytes(expected) == as_bytes(got)
    assert late.last_stamp_s == frames[-1][0]
    assert late.refused_late_frames == 0


@pytest.mark.parametrize("seed", range(5))
def test_frames_of_one_stamp_keep_the_order_in_which_they_come(seed: int) -> None:
    frames = film(seed, 40, repeats=True)
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


def test_a_late_frame_can_reveal_that_somebody_new_is_somebody_known() -> None:
    def seen(tracker: PersonTracker, x_m: float, now: float) -> tuple[PersonTrack, ...]:
        return tracker.update([observe((x_m, 0.0), now)], now, CAMERA)

    tracker = PersonTracker()
    seen(tracker, 3.0, 0.0)
    # Too fast for one person, who has not been seen for long, until the frame in between comes.
    assert {track.id for track in seen(tracker, 4.4, 0.4)} == {2}
    assert {track.id for track in seen(tracker, 3.7, 0.2)} == {1}


def test_too_late_is_refused_counted_and_leaves_no_trace() -> None:
    tracker, twin = PersonTracker(), PersonTracker()
    frames = film(3)
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


def test_without_a_lag_every_earlier_frame_is_too_late() -> None:
    tracker = PersonTracker(TrackerConfig(max_lag_s=0.0))
    tracker.update([], 1.0, CAMERA)
    tracker.update([], 1.0, CAMERA)
    with pytest.raises(TrackingError, match=r"at most max_lag_s = 0 s late"):
        tracker.update([], 1.0 - 1e-9, CAMERA)


def test_a_frame_before_the_very_first_may_be_late_too() -> None:
    first, second = film(8)[:2]
    tracker, twin = PersonTracker(), PersonTracker()
    assert as_bytes(play(tracker, [second, first])) == as_bytes(play(twin, [first, second]))


def test_a_view_that_fails_leaves_no_trace() -> None:
    class Failing:
        fails = False

        def visibility(self, positions_odom_m: FloatArray, _T: FloatArray) -> FloatArray:
            return np.full(len(positions_odom_m), np.nan if self.fails else 1.0)

    view = Failing()
    tracker, twin = PersonTracker(view=view), PersonTracker(view=view)
    frames = film(4)
    play(tracker, frames[:40])
    play(twin, frames[:40])
    view.fails = True
    late_s = frames[36][0] + 1e-3
    with pytest.raises(TrackingError, match=r"one number in \[0, 1\] a position"):
        tracker.update([], late_s, CAMERA)
    view.fails = False
    assert as_bytes(play(tracker, frames[40:])) == as_bytes(play(twin, frames[40:]))


def test_the_history_has_a_bound_at_any_frame_rate() -> None:
    tracker = PersonTracker()
    for step in range(400):
        tracker.update([observe((3.0, 0.0), 1e-4 * step)], 1e-4 * step, CAMERA)
    assert len(tracker.state()["frames"]) == 256
    with pytest.raises(TrackingError, match="more than the 256 frames"):
        tracker.update([], 0.01, CAMERA)
    tracker.update([], 0.039, CAMERA)
