"""Frames are taken, lost and delivered as the timing is configured."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests import SimError
from sim_tests.world.camera import CameraTiming, FrameClock, FrameQueue


def _frames(timing: CameraTiming, count: int, seed: int = 0) -> list[tuple[float, float | None]]:
    """Return stamp and delivery (None: lost) of frames from 5 s on."""
    rng = np.random.default_rng(seed)
    assert timing.rate_hz is not None
    stamps = [5.0 + number / timing.rate_hz for number in range(count)]
    return [(stamp, timing.delivery_s(stamp, rng)) for stamp in stamps]


def test_losses_and_delays_have_the_configured_statistics() -> None:
    timing = CameraTiming(rate_hz=30.0, drop_rate=0.2, latency_s=0.05, latency_jitter_s=0.03)
    count = 5_000
    frames = _frames(timing, count)
    delays = np.array([end - stamp for stamp, end in frames if end is not None])
    lost = 1.0 - len(delays) / count
    assert lost == pytest.approx(0.2, abs=5.0 * math.sqrt(0.2 * 0.8 / count))
    assert delays.min() >= 0.05 - 1e-9
    assert delays.max() <= 0.08 + 1e-9
    # A uniform distribution: mean in the middle, variance of its width squared over twelve.
    assert delays.mean() == pytest.approx(0.065, abs=5.0 * 0.03 / math.sqrt(12.0 * len(delays)))
    assert delays.var() == pytest.approx(0.03**2 / 12.0, rel=0.08)


@settings(max_examples=50, deadline=None)
@given(
    st.floats(5.0, 60.0),
    st.floats(0.0, 0.5),
    st.floats(0.0, 0.3),
    st.floats(0.0, 0.3),
    st.integers(0, 99),
)
def test_the_queue_returns_each_frame_once_when_it_has_arrived(
    rate_hz, drop_rate, latency_s, jitter_s, seed
):
    timing = CameraTiming(
        rate_hz=rate_hz, drop_rate=drop_rate, latency_s=latency_s, latency_jitter_s=jitter_s
    )
    frames = _frames(timing, 40, seed)
    queue: FrameQueue[tuple[float, float]] = FrameQueue()
    expected = [(stamp, end) for stamp, end in frames if end is not None]
    received: list[tuple[float, float]] = []
    waiting = list(frames)
    for now in np.arange(5.0, frames[-1][0] + 1.0, 0.017):
        while waiting and waiting[0][0] <= now:
            stamp, end = waiting.pop(0)
            queue.put(stamp, end, (stamp, end if end is not None else math.nan))
        arrived = queue.take(float(now))
        assert all(end <= now + 1e-5 for _, end in arrived)
        received += arrived
    assert sorted(received) == sorted(expected)
    assert [end for _, end in received] == sorted(end for _, end in received)
    assert len(queue) == 0


def test_frames_that_arrive_together_come_in_the_order_they_were_taken() -> None:
    queue: FrameQueue[str] = FrameQueue()
    queue.put(2.0, 3.0, "second")
    queue.put(1.0, 3.0, "first")
    queue.put(1.5, None, "lost")
    assert queue.take(2.9) == ()
    assert len(queue) == 2
    assert queue.take(3.0) == ("first", "second")
    with pytest.raises(SimError, match="delivery_s"):
        queue.put(2.0, 1.9, "before it was taken")


@pytest.mark.parametrize(
    ("rate_hz", "tick_hz", "per_second"),
    [(None, 20.0, 20), (10.0, 60.0, 10), (30.0, 60.0, 30), (60.0, 20.0, 20), (24.0, 60.0, 24)],
)
def test_a_clock_takes_as_many_frames_as_the_slower_of_rate_and_ticks(rate_hz, tick_hz, per_second):
    clock = FrameClock(CameraTiming(rate_hz=rate_hz), np.random.default_rng(0))
    taken = [k / tick_hz for k in range(round(10 * tick_hz)) if clock.tick(k / tick_hz)[0]]
    assert len(taken) == 10 * per_second
    if rate_hz is not None:
        # No frame is taken before its time or more than one tick after it.
        late = np.array(taken) * rate_hz % 1.0 / rate_hz
        assert np.minimum(late, 1.0 / rate_hz - late).max() < 1.0 / tick_hz + 1e-9
