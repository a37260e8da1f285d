"""Stamps: the rate of a sequence of frames, clocks that jump, and the gate for stamps."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Final, Generic, NamedTuple, TypeVar

Memory = TypeVar("Memory")

# Stamps nearer to each other are those of one frame, and differ by rounding.
_LEAST_INTERVAL_S: Final = 1e-3
# Share of a new interval in the usual time between frames.
_PERIOD_GAIN: Final = 0.2
# Stamps may come slightly out of order.
_DISORDER_S: Final = 0.5
#: Nothing from a sensor for so many of its usual intervals is a gap, or a silence: two frames in a
#: row are missing.
GAP_PERIODS: Final = 2.5
# Steps between stamps differ by this factor at most.
_ALIKE: Final = 2.0
# Two stamps may agree by chance.
_LEAST_STAMPS: Final = 3


class FrameClock(NamedTuple):
    """The stamps of a sequence of frames.

    Attributes:
        stamp_s: of the latest frame, or None before the first.
        interval_s: between the latest two frames; infinite before there are two.
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
        if dt_s < _LEAST_INTERVAL_S:
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


@dataclass(frozen=True, slots=True, eq=False)
class Entry(Generic[Memory]):
    """The way in which a stamp is admitted.

    Attributes:
        memory: of the owner, from which it goes on; nobody changes it in place.
        stamp_s: the stamp.
        source: of the stamp.
        leaps: whether it is far ahead, and may be wrong.
        anew: whether it begins a new clock.
        undone: the leap that it shows to be wrong.
    """

    memory: Memory
    stamp_s: float
    source: str = ""
    leaps: bool = False
    anew: bool = False
    undone: Entry[Memory] | None = None


class Gate(Generic[Memory]):
    """Judges stamps together with its owner, who says which are late, ahead, or in time.

    The owner asks :meth:`new_clock` about a stamp that is late or ahead. A single one is refused.
    Those of one source that follow one another for long enough, while none is in time, begin a new
    clock. For other stamps the owner makes the entry. One may leap ahead, perhaps after a pause; a
    stamp that goes on from before the leap undoes it. An entry counts once it is :meth:`taken`.

    Args:
        max_pause_s: longest step between refused stamps that follow one another.
        new_clock_after_s: time after which they begin a new clock.

    Attributes:
        late: number of stamps refused as late, by source.
        ahead: number of stamps refused as ahead, or undone, by source.
        restarts: how often the clock has been set.
        leap: entry of the latest stamp, if it was a leap.
    """

    def __init__(self, max_pause_s: float, new_clock_after_s: float = 1.0) -> None:
        self._max_pause_s, self._new_clock_after_s = max_pause_s, new_clock_after_s
        self.late: Counter[str] = Counter()
        self.ahead: Counter[str] = Counter()
        self.restarts = 0
        self.forget()

    def forget(self) -> None:
        """Forget all clocks; the counts stay."""
        # Refused stamps that follow one another while none is in time, by source.
        self._jumped: dict[str, JumpedClock] = {}
        self.leap: Entry[Memory] | None = None

    def new_clock(
        self, memory: Memory, stamp_s: float, *, ahead: bool, source: str = ""
    ) -> Entry[Memory] | None:
        """Return the entry of a wrong stamp as a new clock; None if it is refused, and counted."""
        jumped = JumpedClock.following(self._jumped.get(source), stamp_s, self._max_pause_s)
        if jumped.has_lasted(self._new_clock_after_s):
            return Entry(memory, stamp_s, source, anew=True)
        self._jumped[source] = jumped
        (self.ahead if ahead else self.late)[source] += 1
        return None

    def refused_for_s(self, stamp_s: float, within_s: float, source: str = "") -> float:
        """Return since when stamps have been refused that ``stamp_s`` goes on from; 0 for none.

        They are two or more, and the last of them is at most ``within_s`` before.
        """
        jumped = self._jumped.get(source)
        if jumped is None or jumped.stamps < 2 or not 0.0 <= stamp_s - jumped.last_s <= within_s:
            return 0.0
        return stamp_s - jumped.first_s

    def taken(self, entry: Entry[Memory]) -> None:
        """Remember an entry that has been used. It ends the refused stamps of all sources."""
        if entry.anew:
            self.forget()
            self.restarts += 1
        self._jumped, self.leap = {}, entry if entry.leaps else None
        if entry.undone is not None:
            self.ahead[entry.undone.source] += 1
