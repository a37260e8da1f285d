"""The clock of the bridge: steps back, and messages whose stamps lie in the future."""

from __future__ import annotations

from typing import Final, Literal, get_args

from tracking.clock import JumpedClock

from .._errors import NavError

#: Tolerated difference between the clock of a sender and that of this computer.
CLOCK_TOLERANCE_S: Final = 0.05
# A clock that has gone on for so long after a step back has really been set.
_NEW_CLOCK_AFTER_S: Final = 1.0
# Readings follow one another at this distance at most: the slowest rate of publishing is 1 Hz.
_MAX_PAUSE_S: Final = 2.0

InputKind = Literal["odometry", "transforms", "images", "depth_images", "scans"]


class BridgeClock:
    """Time that never goes back, made from readings of a clock that may be stepped.

    A step back of up to 0.05 s, as from NTP, stops the time until the clock has caught up. After a
    longer one there is no time until the clock has gone on for 1 s from there. It has then been
    set, and time starts anew.

    Attributes:
        restarts: how often the clock has been set.
        refused: number of messages from the future, by kind.
    """

    def __init__(self) -> None:
        self.restarts = 0
        self.refused: dict[InputKind, int] = dict.fromkeys(get_args(InputKind), 0)
        self._last_s: float | None = None
        self._jumped: JumpedClock | None = None

    def read(self, now_s: float) -> float:
        """Return the time at a reading, or the reading itself after a long step back."""
        last_s = self._last_s
        if last_s is None or now_s >= last_s:
            self._last_s, self._jumped = now_s, None
            return now_s
        if last_s - now_s <= CLOCK_TOLERANCE_S:
            self._jumped = None
            return last_s
        return now_s

    def advance(self, now_s: float) -> float | None:
        """Return the time, or None after a long step back; for readings at a steady rate.

        A clock that has gone on for long enough counts in :attr:`restarts`.
        """
        time_s = self.read(now_s)
        if self._last_s is None or time_s >= self._last_s:
            return time_s
        self._jumped = JumpedClock.following(self._jumped, now_s, _MAX_PAUSE_S)
        if not self._jumped.has_lasted(_NEW_CLOCK_AFTER_S):
            return None
        self._last_s, self._jumped = now_s, None
        self.restarts += 1
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
