"""Stamps: the rate of a sequence of frames, and clocks that jump."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

# Share of a new interval in the usual time between frames.
_PERIOD_GAIN: Final = 0.2
# Stamps may come slightly out of order.
_DISORDER_S: Final = 0.5
# Steps between stamps differ by this factor at most.
_ALIKE: Final = 2.0
# Two stamps may agree by chance.
_LEAST_STAMPS: Final = 3


class FrameClock(NamedTuple):
    """The stamps of a sequence of frames.

    Attributes:
        stamp_s: of the latest frame, or None before the first.
        interval_s: between the latest two stamps that differ; infinite before there are two.
        period_s: usual time between frames, smoothed over pauses; infinite before there are two.
    """

    stamp_s: float | None = None
    interval_s: float = math.inf
    period_s: float = math.inf

    @property
    def known_period_s(self) -> float:
        """The usual time between frames; 0 where it is unknown."""
        return self.period_s if self.period_s < math.inf else 0.0

    def dt_s(self, stamp_s: float) -> float:
        """Return the time from the latest frame to ``stamp_s``; 0 before the first frame."""
        return 0.0 if self.stamp_s is None else stamp_s - self.stamp_s

    def after(self, stamp_s: float) -> FrameClock:
        """Return the clock after one more frame, whose stamp is not before the latest.

        In the usual time a pause counts as two intervals.
        """
        dt_s, period_s = self.dt_s(stamp_s), self.period_s
        if dt_s <= 0.0:
            return FrameClock(stamp_s, self.interval_s, period_s)
        if period_s < math.inf:
            period_s += _PERIOD_GAIN * (min(dt_s, 2.0 * period_s) - period_s)
        else:
            period_s = dt_s
        return FrameClock(stamp_s, dt_s, period_s)


class JumpedClock(NamedTuple):
    """Refused stamps that follow one another: one clock, and perhaps the new one.

    Attributes:
        first_s: the first of them.
        last_s: the latest.
        stamps: how many there are.
    """

    first_s: float
    last_s: float
    stamps: int = 1

    @staticmethod
    def following(before: JumpedClock | None, stamp_s: float, max_pause_s: float) -> JumpedClock:
        """Return the clock after one more refused stamp, which may begin another one.

        Steps up to ``max_pause_s`` follow one another, and longer ones that are alike: some cameras
        send a frame now and then.

        A stamp that is slightly out of order neither counts nor ends the clock. It may be its
        first one.
        """
        if before is not None and -_DISORDER_S <= stamp_s - before.last_s < 0.0:
            return JumpedClock(min(before.first_s, stamp_s), before.last_s, before.stamps)
        if before is not None and 0.0 <= stamp_s - before.last_s <= before._longest_s(max_pause_s):
            return JumpedClock(before.first_s, stamp_s, before.stamps + 1)
        return JumpedClock(stamp_s, stamp_s)

    def _longest_s(self, max_pause_s: float) -> float:
        if self.stamps == 1:
            return math.inf
        usual_s = (self.last_s - self.first_s) / (self.stamps - 1)
        return max(max_pause_s, _ALIKE * usual_s)

    def has_lasted(self, seconds: float) -> bool:
        """Return whether the stamps span this time, and are more than two."""
        return self.stamps >= _LEAST_STAMPS and self.last_s - self.first_s >= seconds
