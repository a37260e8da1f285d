"""The clock of the bridge: steps back, and messages whose stamps lie in the future."""

from __future__ import annotations

import math
from typing import Final, Literal, get_args

from tracking.clock import Gate

from .._errors import NavError

#: Tolerated difference between the clock of a sender and that of this computer.
CLOCK_TOLERANCE_S: Final = 0.05
# Readings follow one another at this distance at most: the slowest rate of publishing is 1 Hz.
_MAX_PAUSE_S: Final = 2.0

InputKind = Literal["odometry", "transforms", "images", "depth_images", "scans"]


class BridgeClock(Gate[None]):
    """Time that never goes back, made from readings of a clock that may be stepped.

    A step back of up to 0.05 s, as from NTP, stops the time until the clock has caught up. After a
    longer one there is no time until the clock has gone on for 1 s from there. It has then been
    set, and time starts anew.

    Attributes:
        refused: number of messages from the future, by kind.
    """

    def __init__(self) -> None:
        super().__init__(_MAX_PAUSE_S)
        self.refused: dict[InputKind, int] = dict.fromkeys(get_args(InputKind), 0)
        self._last_s = -math.inf

    def read(self, now_s: float) -> float:
        """Return the time at a reading, or the reading itself after a long step back."""
        # Written so that NaN is no time.
        if not self._last_s - now_s <= CLOCK_TOLERANCE_S:
            return now_s
        self._last_s = max(self._last_s, now_s)
        self.forget()
        return self._last_s

    def advance(self, now_s: float) -> float | None:
        """Return the time, or None after a long step back; for readings at a steady rate.

        A clock that has gone on for long enough counts in :attr:`restarts`.
        """
        time_s = self.read(now_s)
        if time_s >= self._last_s:
            return time_s
        entry = self.new_clock(None, now_s, ahead=False)
        if entry is None:
            return None
        self.taken(entry)
        self._last_s = now_s
        return now_s

    def refusal(self, kind: InputKind, stamp_s: float, now_s: float) -> str | None:
        """Return why a message is refused, and count it; None for one that is not ahead."""
        ahead_s = stamp_s - self.read(now_s)
        # Written so that NaN is refused.
        if ahead_s <= CLOCK_TOLERANCE_S:
            return None
        self.refused[kind] += 1
        return f"stamp is {ahead_s:.3f} s ahead of this computer's clock"

    def check(self, kind: InputKind, stamp_s: float, now_s: float, whose: str) -> None:
        """Count and refuse a message from the future.

        Raises:
            NavError: for one; its text begins with ``whose``.
        """
        if (refusal := self.refusal(kind, stamp_s, now_s)) is not None:
            raise NavError(f"{whose} {refusal}")
