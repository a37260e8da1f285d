"""Clocks that jump: one wrong stamp costs one frame, a clock that has been set costs a second."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, as_bytes, observe

from tracking import PersonTrack, PersonTracker, TrackerConfig, TrackingError

CONFIG = TrackerConfig()


def show(tracker: PersonTracker, stamp_s: float) -> tuple[PersonTrack, ...]:
    return tracker.update([observe((3.0, 0.0), stamp_s)], stamp_s, CAMERA)


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


@pytest.mark.parametrize("jump_s", [11.0, 3600.0, 1e9, -1.0, -3600.0, -1e9])
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
def test_a_clock_that_has_been_set_costs_a_second(
    jump_s: float, caplog: pytest.LogCaptureFixture
) -> None:
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


def test_a_short_pause_is_no_jump() -> None:
    tracker = PersonTracker()
    play(tracker, 0.0, 40)
    refused, _ = play(tracker, 39 * PERIOD_S + CONFIG.max_pause_s, 5)
    assert refused == 0


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


STEPS = st.lists(
    st.sampled_from([PERIOD_S] * 12 + [3600.0, -3600.0, 7.0, -0.2, -2.0, 1e6]), max_size=60
)


@given(STEPS)
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


@given(STEPS)
def test_good_frames_are_taken_again_within_a_second_whatever_came_before(
    steps: Sequence[float],
) -> None:
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
