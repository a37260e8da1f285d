"""The frames of one sensor in time: the latest stamp and the usual time between frames."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

# Share of a new interval in the usual time between frames.
_PERIOD_GAIN: Final = 0.2


@dataclass(frozen=True, slots=True)
class FrameClock:
    """The stamps of a sequence of frames.

    Attributes:
        stamp_s: of the latest frame, or None before the first.
        interval_s: between the latest two stamps that differ; infinite before there are two.
        period_s: usual time between frames, smoothed over pauses; infinite before there are two.
    """

    stamp_s: float | None = None
    interval_s: float = math.inf
    period_s: float = math.inf

    def dt_s(self, stamp_s: float) -> float:
        """Return the time from the latest frame to ``stamp_s``; 0 before the first frame."""
        return 0.0 if self.stamp_s is None else stamp_s - self.stamp_s

    def after(self, stamp_s: float) -> FrameClock:
        """Return the clock after one more frame, whose stamp is not before the latest."""
        dt_s = self.dt_s(stamp_s)
        return FrameClock(
            stamp_s,
            dt_s if dt_s > 0.0 else self.interval_s,
            smoothed_period_s(self.period_s, dt_s),
        )


def smoothed_period_s(period_s: float, dt_s: float) -> float:
    """Return the usual time between frames after one more interval; a pause counts as two."""
    if dt_s <= 0.0:
        return period_s
    if not math.isfinite(period_s):
        return dt_s
    return period_s + _PERIOD_GAIN * (min(dt_s, 2.0 * period_s) - period_s)
