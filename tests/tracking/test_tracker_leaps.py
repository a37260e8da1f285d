"""A frame that is ahead by less than ``max_pause_s`` is taken back if the clock returns."""

from __future__ import annotations

import logging
import re

import pytest
from fusion_scenes import LASER, everything, laser_at, seen_by_laser, sensors
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, observe

from tracking import PersonTrack, PersonTracker, SensorConfig, TrackerConfig, TrackingError

CONFIG = TrackerConfig()
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


@pytest.mark.parametrize("ahead_s", [0.7, 1.0, 3.0, 9.9])
def test_one_frame_ahead_costs_one_frame_and_no_track(ahead_s: float) -> None:
    tracker, twin = PersonTracker(), PersonTracker()
    for step in range(80):
        now = step * PERIOD_S
        if step % 20 == 10:
            show(tracker, now + ahead_s)
        assert everything(show(tracker, now)) == everything(show(twin, now))
    assert tracker.refused_early_frames == 4
    assert tracker.refused_late_frames == 0
    assert tracker.refused_frames == {"camera": 4}
    assert tracker.clock_restarts == 0
    assert [track.id for track in show(tracker, now + PERIOD_S)] == [1]


def test_ids_of_a_frame_that_is_taken_back_are_not_used_again() -> None:
    tracker = PersonTracker()
    for step in range(20):
        show(tracker, step * PERIOD_S)
    wrong = {track.id for track in show(tracker, 19 * PERIOD_S + 5.0)}
    assert wrong == {2}
    now = 20 * PERIOD_S
    seen = [observe(place, now) for place in (PLACE_M, (6.0, 2.0))]
    assert [track.id for track in tracker.update(seen, now, CAMERA)] == [1, 3]


@pytest.mark.parametrize("wrong", ["camera", LASER])
@pytest.mark.parametrize("right", ["camera", LASER])
def test_a_frame_of_any_sensor_in_time_shows_it(wrong: str, right: str) -> None:
    tracker, twin = pair()
    for step in range(60):
        now = step * PERIOD_S
        for sensor in ("camera", LASER):
            assert everything(show(tracker, now, sensor)) == everything(show(twin, now, sensor))
        if step == 30:
            show(tracker, now + 4.0, wrong)
            later_s = now + 0.5 * PERIOD_S
            assert everything(show(tracker, later_s, right)) == everything(
                show(twin, later_s, right)
            )
    assert tracker.refused_early_frames == 1
    assert tracker.refused_frames == {"camera": 0, LASER: 0, wrong: 1}


def test_a_pause_is_still_a_pause() -> None:
    tracker = PersonTracker()
    for step in range(20):
        show(tracker, step * PERIOD_S)
    for step in range(20):
        show(tracker, 5.0 + step * PERIOD_S)
    assert tracker.last_stamp_s == pytest.approx(5.0 + 19 * PERIOD_S)
    assert tracker.refused_frames == {"camera": 0}


def test_a_frame_of_before_a_pause_that_has_been_confirmed_is_late() -> None:
    tracker = PersonTracker()
    for step in range(20):
        show(tracker, step * PERIOD_S)
    show(tracker, 5.0)
    show(tracker, 5.0 + PERIOD_S)
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
                assert everything(tracks) == everything(show(twin, stamp_s, "left"))
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


STEPS = st.lists(
    st.tuples(
        st.sampled_from([PERIOD_S] * 10 + [3.0, -3.0, 0.7, -0.7, -0.2, 8.0]),
        st.sampled_from(["camera", LASER]),
    ),
    max_size=50,
)


@pytest.mark.parametrize(
    ("offset_s", "shut_out", "other"), [(0.8, "camera", LASER), (-0.8, LASER, "camera")]
)
def test_a_sensor_that_is_shut_out_is_named_once(
    offset_s: float, shut_out: str, other: str, caplog: pytest.LogCaptureFixture
) -> None:
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
