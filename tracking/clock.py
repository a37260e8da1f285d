"""Clocks that jump: stamps that do not follow the last ones, and when to believe them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

# Stamps may come slightly out of order.
_DISORDER_S: Final = 0.5
# Steps between stamps differ by this factor at most.
_ALIKE: Final = 2.0
# Two stamps may agree by chance.
_LEAST_STAMPS: Final = 3


@dataclass(frozen=True, slots=True)
class JumpedClock:
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
