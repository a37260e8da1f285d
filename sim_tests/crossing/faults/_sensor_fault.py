"""A fault of one sensor: settings, and the change of what the sensor delivers.

A new fault is a class in ``_camera.py`` or ``_scans.py``, named in the tuple at the end of that
file. Its fields are the keys of the fault's file; with :attr:`SensorFault.key` they are the keys of
a mapping of that name.
"""

from __future__ import annotations

import math
import zlib
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Final, Generic, TypeVar

import numpy as np
from pydantic import Field, model_validator

from perception import Camera
from perception.arrays import FloatArray

from ...world.config import SimConfig
from ...world.scanner import ScannerSpec
from .._messages import Change, Delivery

# Random streams of faults are separate from all others of an episode.
_STREAM: Final = 0xFA017

MessageT = TypeVar("MessageT")
_ThingT = TypeVar("_ThingT")


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """The start of an episode for one fault of one sensor, and the fault's random streams.

    Attributes:
        seed: seed of the episode.
        camera: camera of the robot.
        name: name of the fault's class.
        repeat: number of faults of this class before this one.
        scanner: the scanner of a fault of scans, with its true mounting.
        number: its number, from 0.
        body_base_m: (M, 2) outline of the robot in the base frame.
    """

    seed: int
    camera: Camera
    name: str
    repeat: int = 0
    scanner: ScannerSpec = field(default_factory=ScannerSpec)
    number: int = 0
    body_base_m: FloatArray | None = None

    def rng(self, *stream: int) -> np.random.Generator:
        """Return the generator of a stream that no other fault draws from.

        Without a number it is the stream of the fault's name. The faults that were shipped first
        have numbers, so that their episodes stay the same.
        """
        key = stream or (zlib.crc32(self.name.encode()), self.number)
        if self.repeat:
            key = (*key, self.repeat)
        return np.random.default_rng(np.random.SeedSequence([_STREAM, self.seed], spawn_key=key))


class SensorFault(SimConfig):
    """A fault of one sensor as data, which an episode begins with :meth:`begin`.

    A fault has no state. What it must remember in an episode, its change remembers.
    """

    #: Key of the mapping that holds the fields; empty if they are keys of the file themselves.
    key: ClassVar[str] = ""

    @abstractmethod
    def begin(self, start: Start) -> Change[Any]:
        """Return the change of what the sensor delivers in one episode, in order of time."""


class PictureFault(SensorFault):
    """A fault of the camera's pictures, before people are detected in them."""


class ImageFault(SensorFault):
    """A fault of the camera's images on their way to the tracker, or of the people in them."""


class OdometryFault(SensorFault):
    """A fault of pose and speed of the robot, which are sent in every control cycle."""


class ScanFault(SensorFault):
    """A fault of the laser scanners; its keys stand below ``scanner``.

    Attributes:
        only: number of the one scanner with the fault, from 1; None for all of them. It is one key
            below ``scanner``, and holds for all faults there.
    """

    only: int | None = Field(default=None, ge=1)


class Onset(SimConfig):
    """The time from which something holds until the end; the default is the start of the episode.

    Attributes:
        after_s: it begins then at the earliest.
        within_s: and at most this much later, evenly distributed over the episodes; 0 for exactly
            then.
    """

    after_s: float = Field(default=0.0, ge=0.0, le=600.0)
    within_s: float = Field(default=0.0, ge=0.0, le=600.0)

    def begins_s(self, draw: float) -> float:
        """Return the time for a number drawn evenly from 0 to 1."""
        return self.after_s + draw * self.within_s


class Outage(SimConfig):
    """A repeated outage; the default has none.

    In each episode the first outage begins at a random time within the first ``every_s``, uniformly
    distributed, so that over many episodes every instant of an encounter is hit.

    Attributes:
        for_s: duration of each outage; 0 for none.
        every_s: time from the beginning of one to that of the next, longer than ``for_s``.
        fresh_stamps: the last message is repeated as if it were new, which no receiver can tell;
            False repeats it with its old stamp.
    """

    for_s: float = Field(default=0.0, ge=0.0, le=600.0)
    every_s: float = Field(default=10.0, gt=0.0, le=3600.0)
    fresh_stamps: bool = True

    @model_validator(mode="after")
    def _ends_before_the_next(self) -> Outage:
        if self.for_s >= self.every_s:
            raise ValueError(
                f"for_s must be shorter than every_s, got {self.for_s:g} s of {self.every_s:g} s"
            )
        return self

    def holds(self, t_s: float, first_s: float) -> bool:
        """Return whether there is an outage at ``t_s`` if the first one begins at ``first_s``."""
        return t_s >= first_s and (t_s - first_s) % self.every_s < self.for_s

    def frozen(
        self, draw: float, restamped: Callable[[MessageT, MessageT], MessageT]
    ) -> Change[MessageT]:
        """Return a change that repeats the last message during an outage.

        Args:
            draw: a number drawn evenly from 0 to 1, for the beginning of the first outage.
            restamped: returns the last message with the stamp of the present one, which is the
                second argument.
        """
        first_s = draw * self.every_s
        last: MessageT | None = None

        def change(taken: Delivery[MessageT]) -> Delivery[MessageT] | None:
            nonlocal last
            if not self.holds(taken.taken_s, first_s):
                last = taken.message
                return taken
            if last is None:
                return None
            message = restamped(last, taken.message) if self.fresh_stamps else last
            return replace(taken, message=message)

        return change


class Appearing(SimConfig):
    """Things that appear as a Poisson process, and stay for a while; the default has none.

    Attributes:
        rate_hz: new ones per second; 0 for none.
        for_s: mean lifetime, exponentially distributed.
    """

    rate_hz: float = Field(default=0.0, ge=0.0, le=100.0)
    for_s: float = Field(default=1.0, gt=0.0, le=600.0)


class Appearances(Generic[_ThingT]):
    """The things that appear in one episode."""

    def __init__(self, appearing: Appearing, rng: np.random.Generator) -> None:
        self._rate_hz, self._rng = appearing.rate_hz, rng
        self._present: list[tuple[float, _ThingT]] = []
        self._next_s = self._interval_s()

    def at(
        self, t_s: float, appear: Callable[[float], tuple[float, _ThingT] | None]
    ) -> list[_ThingT]:
        """Return what is there at ``t_s``, which grows from call to call.

        ``appear`` returns a new thing at a time, and the time until which it stays; None if there
        is no place for one.
        """
        while self._next_s <= t_s:
            new = appear(self._next_s)
            if new is not None:
                self._present.append(new)
            self._next_s += self._interval_s()
        self._present = [each for each in self._present if each[0] > t_s]
        return [thing for _, thing in self._present]

    def _interval_s(self) -> float:
        rate_hz = self._rate_hz
        return math.inf if rate_hz == 0.0 else float(self._rng.exponential(1.0 / rate_hz))
