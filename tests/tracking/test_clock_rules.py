"""Refused stamps that count as one clock that has been set, and the usual time between frames."""

from __future__ import annotations

import math

import pytest

from tracking.clock import Entry, FrameClock, Gate, JumpedClock

MAX_PAUSE_S = 10.0


def after(*stamps_s: float) -> JumpedClock:
    clock: JumpedClock | None = None
    for stamp_s in stamps_s:
        clock = JumpedClock.following(clock, stamp_s, MAX_PAUSE_S)
    assert clock is not None
    return clock


@pytest.mark.parametrize(
    ("stamps_s", "expected"),
    [
        ([5.0], (5.0, 5.0, 1)),
        ([5.0, 5.0], (5.0, 5.0, 2)),
        # The second stamp may come at any time, the third as late as twice the steps before.
        ([5.0, 45.0], (5.0, 45.0, 2)),
        ([5.0, 45.0, 125.0], (5.0, 125.0, 3)),
        ([5.0, 45.0, 125.1], (125.1, 125.1, 1)),
        ([5.0, 45.0, 85.0, 165.0], (5.0, 165.0, 4)),
        ([5.0, 45.0, 85.0, 165.1], (165.1, 165.1, 1)),
        # Pauses up to the longest always follow.
        ([5.0, 5.1, 15.1], (5.0, 15.1, 3)),
        ([5.0, 5.1, 15.2], (15.2, 15.2, 1)),
        # A stamp up to 0.5 s out of order neither counts nor ends the clock, and may be its first.
        ([5.0, 4.5], (4.5, 5.0, 1)),
        ([5.0, 5.1, 4.8], (4.8, 5.1, 2)),
        ([5.0, 5.4, 5.2], (5.0, 5.4, 2)),
        ([5.0, 4.4], (4.4, 4.4, 1)),
    ],
)
def test_which_stamps_follow_one_another(stamps_s, expected) -> None:
    clock = after(*stamps_s)
    assert (clock.first_s, clock.last_s, clock.stamps) == expected


def test_a_clock_has_lasted_with_three_stamps_and_the_time() -> None:
    assert after(5.0, 5.5, 6.0).has_lasted(1.0)
    assert not after(5.0, 5.5, 5.9).has_lasted(1.0)
    assert not after(5.0, 6.5).has_lasted(1.0)


def test_the_period_follows_slowly_and_a_pause_counts_as_two_frames() -> None:
    clock = FrameClock()
    assert (clock.dt_s(3.0), clock.interval_s, clock.period_s) == (0.0, math.inf, math.inf)
    clock = clock.after(3.0).after(3.1)
    assert clock.dt_s(3.3) == pytest.approx(0.2)
    assert (clock.interval_s, clock.period_s) == pytest.approx((0.1, 0.1))
    # A second frame with one stamp changes nothing.
    assert clock.after(3.1) == clock
    faster = clock.after(3.15)
    assert faster.interval_s == pytest.approx(0.05)
    assert 0.08 < faster.period_s < 0.1
    gain = (0.1 - faster.period_s) / 0.05
    assert clock.after(3.25).period_s == pytest.approx(0.1 + gain * 0.05)
    assert clock.after(3.3).period_s == pytest.approx(0.1 + gain * 0.1)
    assert clock.after(9.0).period_s == pytest.approx(0.1 + gain * 0.1)


def test_the_gate_says_for_how_long_stamps_have_been_refused() -> None:
    gate: Gate[None] = Gate(2.0)
    assert gate.refused_for_s(5.0, 1.0) == 0.0
    gate.new_clock(None, 5.0, ahead=False)
    assert gate.refused_for_s(5.1, 1.0) == 0.0  # one alone is no clock
    gate.new_clock(None, 5.3, ahead=False)
    assert gate.refused_for_s(5.4, 1.0) == pytest.approx(0.4)
    assert gate.refused_for_s(5.4, 1.0, "another source") == 0.0
    assert gate.refused_for_s(6.3, 1.0) == pytest.approx(1.3)
    assert gate.refused_for_s(6.4, 1.0) == 0.0  # too late to go on from them
    assert gate.refused_for_s(5.2, 1.0) == 0.0  # before the last of them
    gate.taken(Entry(None, 5.4))
    assert gate.refused_for_s(5.5, 1.0) == 0.0
