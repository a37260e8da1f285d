"""Clocks and order: late frames, wrong stamps, frames far ahead, and clocks that have been set."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import pytest
from fusion_scenes import LASER, laser_at, seen_by_laser, sensors
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, as_bytes, camera_at, observe

from perception import Camera, PersonObservation
from tracking import (
    CameraView,
    PersonTrack,
    PersonTracker,
    SensorConfig,
    TrackerConfig,
    TrackingError,
)

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


def play_frames(tracker: PersonTracker, frames: list[Frame]) -> tuple[PersonTrack, ...]:
    tracks: tuple[PersonTrack, ...] = ()
    for now, people, T in frames:
        tracks = tracker.update(people, now, T)
    return tracks


def delayed(frames: list[Frame], rng: np.random.Generator, share: float = 1.0) -> list[Frame]:
    """Return the frames in the order of arrival, with random latencies within the lag."""
    arrivals_s = [now + share * LAG_S * rng.uniform() for now, *_ in frames]
    return [frames[i] for i in sorted(range(len(frames)), key=lambda i: arrivals_s[i])]


@pytest.mark.parametrize("has_view", [False, True])
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_frames_shuffled_within_the_lag_give_the_tracks_of_frames_in_order(has_view, seed) -> None:
    frames = make_frames(seed)
    view = CameraView(Camera.from_fov(640, 480, 1.2)) if has_view else None
    shuffled = delayed(frames, np.random.default_rng(seed + 1))
    in_order, late = PersonTracker(view=view), PersonTracker(view=view)
    expected, got = play_frames(in_order, frames), play_frames(late, shuffled)
    assert [track.id for track in expected] == [track.id for track in got]
    assert as_bytes(expected) == as_bytes(got)
    assert late.last_stamp_s == frames[-1][0]
    assert late.refused_late_frames == 0


@pytest.mark.parametrize("seed", range(2))
def test_frames_with_the_same_stamp_keep_their_order_of_arrival(seed: int) -> None:
    frames = make_frames(seed, 40, repeats=True)
    rng = np.random.default_rng(seed)
    latency = {now: LAG_S * rng.uniform() for now, *_ in frames}
    shuffled = sorted(frames, key=lambda frame: frame[0] + latency[frame[0]])
    assert as_bytes(play_frames(PersonTracker(), frames)) == as_bytes(
        play_frames(PersonTracker(), shuffled)
    )


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
    play_frames(tracker, frames[:40])
    play_frames(twin, frames[:40])
    last_s = frames[39][0]
    for count in (1, 2):
        late_s = last_s - LAG_S - 1e-6 * count
        with pytest.raises(TrackingError, match=r"at most max_lag_s = 0\.5 s late"):
            tracker.update([observe((3.0, 0.0), late_s)], late_s, CAMERA)
        assert tracker.refused_late_frames == count
    assert as_bytes(play_frames(tracker, frames[40:])) == as_bytes(play_frames(twin, frames[40:]))
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
    assert as_bytes(play_frames(tracker, [second, first])) == as_bytes(
        play_frames(twin, [first, second])
    )


def test_the_history_is_bounded_at_any_frame_rate() -> None:
    tracker = PersonTracker()
    for step in range(400):
        tracker.update([observe((3.0, 0.0), 1e-4 * step)], 1e-4 * step, CAMERA)
    with pytest.raises(TrackingError, match="more than the 256 frames"):
        tracker.update([], 0.01, CAMERA)
    tracker.update([], 0.039, CAMERA)


CONFIG = TrackerConfig()


def play(
    tracker: PersonTracker, start_s: float, frames: int
) -> tuple[int, tuple[PersonTrack, ...]]:
    """Show one person in frames; return how many were refused, and the last tracks."""
    refused, tracks = 0, ()
    for step in range(frames):
        try:
            tracks = show(tracker, start_s + step * PERIOD_S)
        except TrackingError:
            refused += 1
    return refused, tracks


@pytest.mark.parametrize("jump_s", [11.0, 1e9, -1.0, -3600.0])
def test_one_frame_with_a_wrong_stamp_costs_one_frame(jump_s: float) -> None:
    tracker, twin = PersonTracker(), PersonTracker()
    for step in range(60):
        now = step * PERIOD_S
        if step % 20 == 10:
            with pytest.raises(TrackingError, match=r"jumps ahead|the last frame was at"):
                show(tracker, now + jump_s)
        assert as_bytes(show(tracker, now)) == as_bytes(show(twin, now))
    counts = tracker.refused_early_frames, tracker.refused_late_frames
    assert counts == ((3, 0) if jump_s > 0.0 else (0, 3))
    assert tracker.clock_restarts == 0


def test_a_camera_that_sends_a_frame_now_and_then_is_believed() -> None:
    """Every 12 s, longer apart than ``max_pause_s``."""
    tracker, accepted = PersonTracker(), 0
    for step in range(20):
        try:
            show(tracker, 12.0 * step)
            accepted += 1
        except TrackingError:
            pass
    assert tracker.clock_restarts >= 3
    assert accepted >= 5


@pytest.mark.parametrize("jump_s", [3600.0, -3600.0, 1e9, -2.0])
def test_a_clock_that_has_been_set_costs_a_second(jump_s, caplog) -> None:
    tracker = PersonTracker()
    _, (before,) = play(tracker, 5000.0, 40)
    with caplog.at_level(logging.WARNING, logger="tracking"):
        refused, (after,) = play(tracker, 5002.0 + jump_s, 60)
    assert refused * PERIOD_S == pytest.approx(CONFIG.new_clock_after_s, abs=1.5 * PERIOD_S)
    assert tracker.clock_restarts == 1
    assert tracker.refused_early_frames + tracker.refused_late_frames == refused
    assert [record.getMessage()[:22] for record in caplog.records] == ["the clock has been set"]
    assert after.id > before.id
    assert after.status == "confirmed"


@pytest.mark.parametrize("after_s", [0.0, 0.5, 3.0])
def test_the_time_until_a_new_clock_is_believed_is_a_setting(after_s: float) -> None:
    tracker = PersonTracker(TrackerConfig(new_clock_after_s=after_s))
    play(tracker, 0.0, 40)
    refused, _ = play(tracker, 3600.0, 100)
    assert refused == pytest.approx(max(2.0, after_s / PERIOD_S), abs=1.0)


def test_two_clocks_at_once_do_not_restart_the_tracker() -> None:
    """One of two cameras has a wrong clock: the other one's frames go on."""
    tracker, twin = PersonTracker(), PersonTracker()
    for step in range(100):
        now = step * PERIOD_S
        assert as_bytes(show(tracker, now)) == as_bytes(show(twin, now))
        if step:
            with pytest.raises(TrackingError):
                show(tracker, now - 3600.0)
    assert tracker.clock_restarts == 0


def test_reset_forgets_people_and_clock_and_goes_on_with_the_ids() -> None:
    tracker = PersonTracker()
    _, (before,) = play(tracker, 100.0, 20)
    tracker.reset()
    assert tracker.last_stamp_s is None
    assert tracker.predict(0.0) == ()
    (after,) = show(tracker, 1.0)
    assert after.id > before.id
    assert after.status == "tentative"


def test_a_frame_refused_for_another_reason_is_no_evidence_of_a_new_clock() -> None:
    tracker = PersonTracker(TrackerConfig(new_clock_after_s=0.1))
    play(tracker, 0.0, 20)
    play(tracker, 3600.0, 2)
    before = as_bytes(tracker.predict(3600.1))
    mirrored = CAMERA * -1.0
    with pytest.raises(TrackingError, match="T_odom_camera"):
        tracker.update((), 3600.2, mirrored)
    assert as_bytes(tracker.predict(3600.1)) == before


STEPS_S = st.lists(
    st.sampled_from([PERIOD_S] * 12 + [3600.0, -3600.0, 7.0, -0.2, -2.0, 1e6]), max_size=40
)


@settings(max_examples=30, deadline=None)
@given(STEPS_S)
def test_ids_are_never_used_again(steps: Sequence[float]) -> None:
    tracker, now, ever = PersonTracker(), 1e4, 0
    alive: set[int] = set()
    earlier: set[int] = set()
    for step_s in steps:
        now += step_s
        refused = tracker.refused_early_frames
        with suppress(TrackingError):
            show(tracker, now)
        if tracker.last_stamp_s is None or now < tracker.last_stamp_s:
            continue
        ids = {track.id for track in tracker.predict(tracker.last_stamp_s)}
        # Once a frame far ahead is taken back, those who were there before it are there again.
        known = earlier if tracker.refused_early_frames > refused else alive
        assert all(new > ever for new in ids - alive - known)
        if ids - alive or not alive <= ids:
            earlier = alive
        alive, ever = ids, max([ever, *ids])


@settings(max_examples=30, deadline=None)
@given(STEPS_S)
def test_good_frames_are_taken_again_within_a_second_whatever_came_before(steps) -> None:
    tracker, now = PersonTracker(), 1e4
    for step_s in steps:
        now += step_s
        try:
            show(tracker, now)
        except TrackingError:
            continue
    most = round(CONFIG.new_clock_after_s / PERIOD_S) + 3
    refused, tracks = play(tracker, now + PERIOD_S, most + 10)
    assert refused <= most
    assert [track.status for track in tracks] in (["confirmed"], ["confirmed", "confirmed"])


PLACE_M = (3.0, 0.0)
LASER_S = 0.04


def show(tracker: PersonTracker, stamp_s: float, sensor: str = "camera") -> tuple[PersonTrack, ...]:
    if sensor == "camera":
        seen = [observe(PLACE_M, stamp_s, awareness=0.9)]
        return tracker.update(seen, stamp_s, CAMERA)
    return tracker.update([seen_by_laser(PLACE_M, stamp_s)], stamp_s, laser_at(), sensor=sensor)


def pair() -> tuple[PersonTracker, PersonTracker]:
    """Return two trackers with a camera and a scanner."""
    first, second = (PersonTracker(sensors=sensors()) for _ in range(2))
    return first, second


@pytest.mark.parametrize("ahead_s", [0.7, 9.9])
def test_one_frame_ahead_costs_one_frame_and_no_track(ahead_s: float) -> None:
    tracker, twin = PersonTracker(), PersonTracker()
    for step in range(80):
        now = step * PERIOD_S
        if step % 20 == 10:
            show(tracker, now + ahead_s)
        assert as_bytes(show(tracker, now)) == as_bytes(show(twin, now))
    assert tracker.refused_early_frames == 4
    assert tracker.refused_late_frames == 0
    assert tracker.refused_frames == {"camera": 4}
    assert tracker.clock_restarts == 0
    assert [track.id for track in show(tracker, now + PERIOD_S)] == [1]


@pytest.mark.parametrize("wrong", ["camera", LASER])
@pytest.mark.parametrize("right", ["camera", LASER])
def test_a_frame_of_any_sensor_in_time_shows_it(wrong: str, right: str) -> None:
    tracker, twin = pair()
    for step in range(60):
        now = step * PERIOD_S
        for sensor in ("camera", LASER):
            assert as_bytes(show(tracker, now, sensor)) == as_bytes(show(twin, now, sensor))
        if step == 30:
            show(tracker, now + 4.0, wrong)
            later_s = now + 0.5 * PERIOD_S
            assert as_bytes(show(tracker, later_s, right)) == as_bytes(show(twin, later_s, right))
    assert tracker.refused_early_frames == 1
    assert tracker.refused_frames == {"camera": 0, LASER: 0, wrong: 1}


def test_a_pause_is_no_leap_and_a_frame_of_before_it_is_late_once_it_is_confirmed() -> None:
    tracker = PersonTracker()
    for step in range(20):
        show(tracker, step * PERIOD_S)
    show(tracker, 5.0)
    show(tracker, 5.0 + PERIOD_S)
    assert tracker.refused_frames == {"camera": 0}
    with pytest.raises(TrackingError, match="at most max_lag_s"):
        show(tracker, 20 * PERIOD_S)
    assert tracker.refused_late_frames == 1


def test_a_sensor_whose_frames_were_refused_takes_nothing_back() -> None:
    """A camera with a latency of 0.8 s, beside a scanner that pauses for 0.7 s."""
    tracker = PersonTracker(sensors=sensors())
    for step in range(50):
        show(tracker, step * LASER_S, LASER)
        if step > 25 and step % 3 == 0:
            with pytest.raises(TrackingError):
                show(tracker, step * LASER_S - 0.8)
    now = 49 * LASER_S + 0.7
    show(tracker, now, LASER)
    with pytest.raises(TrackingError):
        show(tracker, now - 0.8)
    assert tracker.last_stamp_s == now
    assert tracker.refused_early_frames == 0


def test_a_slow_camera_is_no_leap() -> None:
    """At 1 Hz a frame of 0.7 s before the last one is late, and the last one stays."""
    tracker = PersonTracker()
    for step in range(6):
        show(tracker, float(step))
    with pytest.raises(TrackingError):
        show(tracker, 4.3)
    assert tracker.last_stamp_s == 5.0


TWO = {name: SensorConfig(alignment_std_rad=0.0) for name in ("left", "right")}


def test_two_scanners_of_which_one_runs_ahead_do_not_alternate() -> None:
    """For a second nothing changes for the one that was there; then the one ahead counts."""
    tracker, twin = PersonTracker(sensors=TWO), PersonTracker(sensors=TWO)
    accepted = {"left": [], "right": []}
    for step in range(100):
        now = step * LASER_S
        for sensor, stamp_s in (("left", now), ("right", now + 0.7)):
            if sensor == "right" and step < 10:
                continue
            try:
                tracks = show(tracker, stamp_s, sensor)
            except TrackingError:
                continue
            accepted[sensor].append(step)
            if step < 30 and sensor == "left":
                assert as_bytes(tracks) == as_bytes(show(twin, stamp_s, "left"))
            assert [track.id for track in tracks] == [1]
    assert accepted["left"] == list(range(accepted["left"][-1] + 1))
    lasts = round(CONFIG.new_clock_after_s / LASER_S)
    assert accepted["left"][-1] == pytest.approx(10 + lasts, abs=1)
    assert accepted["right"] == [10, *range(accepted["left"][-1], 100)]
    assert tracker.clock_restarts == 0


def test_if_the_other_scanner_dies_the_one_ahead_goes_on_with_the_same_tracks() -> None:
    tracker = PersonTracker(sensors=TWO)
    for step in range(100):
        now = step * LASER_S
        if step < 20:
            show(tracker, now, "left")
        if step >= 10:
            try:
                tracks = show(tracker, now + 0.7, "right")
            except TrackingError:
                assert 10 < step < 36
    assert tracker.clock_restarts == 0
    assert [track.id for track in tracks] == [1]


@pytest.mark.parametrize(
    ("offset_s", "shut_out", "other"), [(0.8, "camera", LASER), (-0.8, LASER, "camera")]
)
def test_a_sensor_that_is_shut_out_is_named_once(offset_s, shut_out, other, caplog) -> None:
    """The scanner's clock leads or lags by more than ``max_lag_s``."""
    tracker = PersonTracker(sensors=sensors())
    with caplog.at_level(logging.WARNING, logger="tracking"):
        for step in range(150):
            for sensor, late_s in ((LASER, offset_s), ("camera", 0.0)):
                try:
                    show(tracker, 10.0 + step * LASER_S + late_s, sensor)
                except TrackingError:
                    assert sensor == shut_out or step < 30
    (record,) = caplog.records
    message = record.getMessage()
    assert f"all frames of sensor {shut_out!r} are refused" in message
    assert re.search(rf"0\.(7|8)\d\d s behind those of sensor {other!r}", message)
    refused = tracker.refused_frames
    assert refused[shut_out] >= 120
    assert refused[other] <= 30
    assert refused[shut_out] + refused[other] == (
        tracker.refused_late_frames + tracker.refused_early_frames
    )
    tracker.reset()
    assert tracker.refused_frames == refused


def test_two_good_clocks_are_not_worth_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    tracker = PersonTracker(sensors=sensors())
    with caplog.at_level(logging.WARNING, logger="tracking"):
        for step in range(150):
            show(tracker, step * LASER_S, LASER)
            if step % 4 == 0 and step > 20:
                show(tracker, step * LASER_S - 0.4)
    assert caplog.records == []
    assert tracker.refused_frames == {"camera": 0, LASER: 0}
