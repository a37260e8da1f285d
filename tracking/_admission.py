"""Admission of frames of several sensors to a tracker, judged by their stamps."""

from __future__ import annotations

import logging

from ._config import TrackerConfig
from ._errors import TrackingError
from ._history import History
from ._sensors import Sensor, Sensors
from .clock import Entry, Gate, JumpedClock

_LOG = logging.getLogger("tracking")
# A frame ahead by fewer of the usual intervals of its sensor follows the others.
_LEAP_PERIODS = 3.0
# A frame follows the last one of its own sensor if it comes within this time, or as many intervals.
_FOLLOWS_S = 1.0


class Admission(Gate[History]):
    """The gate for the frames of all sensors of a tracker.

    The clock of one sensor may differ from the others': its frames, or theirs, are refused, which
    is worth a warning.

    Args:
        config: the tracker's settings.
        sensors: its sensors.
    """

    def __init__(self, config: TrackerConfig, sensors: Sensors) -> None:
        self._config, self._sensors = config, sensors
        super().__init__(config.max_pause_s, config.new_clock_after_s)

    def forget(self) -> None:
        """Forget all clocks; the counts stay."""
        super().forget()
        # Stamps that follow one another, by sensor: from a leap that was undone, and refused ones.
        self._ahead: dict[str, JumpedClock] = {}
        self._apart: dict[str, JumpedClock] = {}
        self._warned: set[str] = set()

    def frame_entry(self, history: History, stamp_s: float, sensor: Sensor) -> Entry[History]:
        """Return how a frame is taken.

        Raises:
            TrackingError: for a frame that is refused, which is counted.
        """
        last_s, config, leap, name = history.latest.stamp_s, self._config, self.leap, sensor.name
        if last_s is None:
            return Entry(history, stamp_s, name)
        message = history.lateness_error(stamp_s)
        if message is not None and leap is not None and _returns(leap.memory, stamp_s, sensor):
            # The ids that the wrong frame gave are not used again.
            before = leap.memory.with_ids_from(history.latest.next_id)
            return Entry(before, stamp_s, name, undone=leap)
        ahead_s = stamp_s - last_s
        period_s = history.latest.clocks[sensor.index].known_period_s
        leaps = ahead_s > max(config.max_lag_s, _LEAP_PERIODS * period_s)
        if ahead_s > config.max_pause_s:
            message = (
                f"stamp_s = {stamp_s!r} s jumps ahead: the last frame was at {last_s!r} s, and "
                f"max_pause_s = {config.max_pause_s:g} s"
            )
        elif leaps and name in self._ahead:
            if self._lasts(self._ahead, stamp_s, sensor):
                # Two clocks that differ: the one that is ahead counts, as it would have from the
                # start, and no frame of the others takes it back.
                return Entry(history, stamp_s, name)
            message = (
                f"stamp_s = {stamp_s!r} s runs ahead: the last frame was at {last_s!r} s, and "
                f"frames of other sensors have come since one of {name!r} was ahead"
            )
        if message is None:
            return Entry(history, stamp_s, name, leaps)
        entry = self.new_clock(history, stamp_s, ahead=ahead_s > 0.0, source=name)
        if entry is None:
            self._warn(history, stamp_s, sensor)
            raise TrackingError(message)
        _LOG.warning(
            "the clock has been set: frames at %.3f s after %.3f s; the tracker starts anew",
            stamp_s,
            last_s,
        )
        return entry

    def taken(self, entry: Entry[History]) -> None:
        """Remember that a frame has been taken."""
        super().taken(entry)
        self._ahead.pop(entry.source, None)
        self._apart.pop(entry.source, None)
        undone = entry.undone
        if undone is not None and undone.source != entry.source:
            self._ahead[undone.source] = JumpedClock(undone.stamp_s, undone.stamp_s)

    def _lasts(self, runs: dict[str, JumpedClock], stamp_s: float, sensor: Sensor) -> bool:
        """Add a stamp to those of its sensor, and return whether they now make a clock."""
        run = JumpedClock.following(runs.get(sensor.name), stamp_s, self._config.max_pause_s)
        runs[sensor.name] = run
        return run.has_lasted(self._config.new_clock_after_s)

    def _warn(self, history: History, stamp_s: float, sensor: Sensor) -> None:
        """Log once that the frames of a sensor are refused while those of another are not."""
        name = sensor.name
        if not self._lasts(self._apart, stamp_s, sensor) or name in self._warned:
            return
        others = {
            other.name: clock.stamp_s
            for other, clock in zip(self._sensors.all, history.latest.clocks, strict=True)
            if other.name != name and clock.stamp_s is not None
        }
        if not others:
            return
        other = max(others, key=others.__getitem__)
        offset_s = stamp_s - others[other]
        _LOG.warning(
            "all frames of sensor %r are refused: their stamps are %.3f s %s those of sensor %r "
            "(max_lag_s = %g s); one of the two clocks is wrong",
            name,
            abs(offset_s),
            "ahead of" if offset_s > 0.0 else "behind",
            other,
            self._config.max_lag_s,
        )
        self._warned.add(name)


def _returns(before: History, stamp_s: float, sensor: Sensor) -> bool:
    """Return whether a frame goes on from before a leap, as the frames of its sensor did then.

    A sensor whose frames were refused before, for its latency, does not.
    """
    clock = before.latest.clocks[sensor.index]
    if clock.stamp_s is None or before.lateness_error(stamp_s) is not None:
        return False
    follows_s = max(_FOLLOWS_S, _LEAP_PERIODS * clock.known_period_s)
    return 0.0 <= stamp_s - clock.stamp_s <= follows_s
