"""Admission of frames to a tracker, judged by their stamps; one may be taken back later.

Four things can be wrong with a stamp. A single one is late: it is refused. A single one is far
ahead: it is refused, or, if it may be the end of a pause, taken until a frame in time shows that it
was wrong. The clock of all sensors has been set: the tracker starts anew. The clock of one sensor
differs from the others': its frames, or theirs, are refused, which is worth a warning.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass

from ._config import TrackerConfig
from ._errors import TrackingError
from ._history import History
from ._sensors import Sensor, Sensors
from .clock import JumpedClock

_LOG = logging.getLogger("tracking")
# A frame ahead by fewer of the usual intervals of its sensor follows the others.
_LEAP_PERIODS = 3.0
# A frame follows the last one of its own sensor if it comes within this time, or as many intervals.
_FOLLOWS_S = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Leap:
    """A frame far ahead of all others, which may be wrong.

    Attributes:
        before: the history before it.
        sensor: that took it.
        stamp_s: of the frame.
    """

    before: History
    sensor: str
    stamp_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """The way in which a frame is taken.

    Attributes:
        history: to which it belongs; None for a new one, since the clock has been set.
        leap: the frame itself, if it is far ahead.
        undone: the earlier frame that it shows to be wrong.
    """

    history: History | None
    leap: Leap | None = None
    undone: Leap | None = None


class Admission:
    """Decides by their stamps which frames a tracker takes, and counts those that it refuses.

    Args:
        config: the tracker's settings.
        sensors: its sensors.

    Attributes:
        late_frames: number of frames refused as late.
        early_frames: number of frames refused as early, or taken back.
        restarts: how often the clock has been set.
        refused: number of all refused frames, by the name of the sensor.
        jumped: refused stamps that follow one another while no frame is in time, by sensor.
        leap: the latest frame, if it was far ahead.
        ahead: stamps that follow one another from one that was taken back, by sensor.
    """

    def __init__(self, config: TrackerConfig, sensors: Sensors) -> None:
        self._config, self._sensors = config, sensors
        self.late_frames = self.early_frames = self.restarts = 0
        self.refused = {sensor.name: 0 for sensor in sensors.all}
        self.forget()

    def forget(self) -> None:
        """Forget all clocks; the counts stay."""
        self.jumped: dict[str, JumpedClock] = {}
        self.leap: Leap | None = None
        self.ahead: dict[str, JumpedClock] = {}
        self._apart: dict[str, JumpedClock] = {}
        self._warned: set[str] = set()

    def entry(self, history: History, stamp_s: float, sensor: Sensor) -> Entry:
        """Return how a frame is taken. Call :meth:`taken` once it has been.

        Raises:
            TrackingError: for a frame that is refused, which is counted.
        """
        last_s, config, leap = history.latest.stamp_s, self._config, self.leap
        if last_s is None:
            return Entry(history)
        message = history.lateness_error(stamp_s)
        if message is not None and leap is not None and _returns(leap, stamp_s, sensor):
            # The ids that the wrong frame gave are not used again.
            return Entry(leap.before.with_ids_from(history.latest.next_id), undone=leap)
        ahead_s = stamp_s - last_s
        period_s = history.latest.clocks[sensor.index].known_period_s
        leaps = ahead_s > max(config.max_lag_s, _LEAP_PERIODS * period_s)
        if ahead_s > config.max_pause_s:
            message = (
                f"stamp_s = {stamp_s!r} s jumps ahead: the last frame was at {last_s!r} s, and "
                f"max_pause_s = {config.max_pause_s:g} s"
            )
        elif leaps and sensor.name in self.ahead:
            run = JumpedClock.following(self.ahead[sensor.name], stamp_s, config.max_pause_s)
            self.ahead[sensor.name] = run
            if run.has_lasted(config.new_clock_after_s):
                # Two clocks that differ: the one that is ahead counts, as it would have from the
                # start, and no frame of the others takes it back.
                return Entry(history)
            message = (
                f"stamp_s = {stamp_s!r} s runs ahead: the last frame was at {last_s!r} s, and "
                f"frames of other sensors have come since one of {sensor.name!r} was ahead"
            )
        if message is None:
            return Entry(history, Leap(history.copy(), sensor.name, stamp_s) if leaps else None)
        jumped = JumpedClock.following(self.jumped.get(sensor.name), stamp_s, config.max_pause_s)
        self.jumped[sensor.name] = jumped
        if jumped.has_lasted(config.new_clock_after_s):
            _LOG.warning(
                "the clock has been set: frames at %.3f s after %.3f s; the tracker starts anew",
                stamp_s,
                last_s,
            )
            return Entry(None)
        if ahead_s > 0.0:
            self.early_frames += 1
        else:
            self.late_frames += 1
        self.refused[sensor.name] += 1
        self._warn(history, stamp_s, sensor)
        raise TrackingError(message)

    def taken(self, entry: Entry, sensor: Sensor) -> None:
        """Remember that a frame has been taken.

        In time, of any sensor, it shows that the clock has not been set.
        """
        self.jumped, self.leap = {}, entry.leap
        self.ahead.pop(sensor.name, None)
        self._apart.pop(sensor.name, None)
        if entry.undone is not None:
            self.early_frames += 1
            self.refused[entry.undone.sensor] += 1
            if entry.undone.sensor != sensor.name:
                stamp_s = entry.undone.stamp_s
                self.ahead[entry.undone.sensor] = JumpedClock(stamp_s, stamp_s)

    def _warn(self, history: History, stamp_s: float, sensor: Sensor) -> None:
        """Log once that the frames of a sensor are refused while those of another are not."""
        config, name = self._config, sensor.name
        run = JumpedClock.following(self._apart.get(name), stamp_s, config.max_pause_s)
        self._apart[name] = run
        if name in self._warned or not run.has_lasted(config.new_clock_after_s):
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
            config.max_lag_s,
        )
        self._warned.add(name)


def _returns(leap: Leap, stamp_s: float, sensor: Sensor) -> bool:
    """Return whether a frame goes on from before a leap, as the frames of its sensor did then.

    A sensor whose frames were refused before, for its latency, does not.
    """
    clock = leap.before.latest.clocks[sensor.index]
    if clock.stamp_s is None or leap.before.lateness_error(stamp_s) is not None:
        return False
    follows_s = max(_FOLLOWS_S, _LEAP_PERIODS * clock.known_period_s)
    return 0.0 <= stamp_s - clock.stamp_s <= follows_s
