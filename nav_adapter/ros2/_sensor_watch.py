"""A watch over the sensors at work, and whether they see enough to drive on."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from perception import Camera
from perception.arrays import FloatArray
from perception.laser import AHEAD_RAD, ScannerSight, SeenDirections, camera_field

from .._errors import NavError

CAMERA: Final = "camera"
#: The camera's depth images, without which it goes on.
DEPTH: Final = "depth images"


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor at work.

    Attributes:
        name: in messages; each has its own.
        stamp_s: of its latest frame that showed anything; −∞ before the first.
        blind: its blind sectors in words; empty without.
        blind_since_s: the time from which it has been blind.
        trouble: the one that has been reported last; empty without.
    """

    name: str
    stamp_s: float = -math.inf
    blind: str = ""
    blind_since_s: float = math.inf
    trouble: str = ""

    @property
    def heard(self) -> bool:
        """Whether anything has come from it."""
        return self.stamp_s > -math.inf


class SensorWatch:
    """The table of the sensors: when each last saw something, and where they look.

    A scan counts only where it shows what is there: what lies in the blind sectors of a scanner is
    as old as if the scanner were silent. While the camera is lost, scanners replace it only if they
    see all of its field: the robot must not drive on with less in view than the camera alone would
    have. One thread at a time may use it.

    A sensor that is silent for longer than ``lost_after_s`` is lost.

    Raises:
        NavError: for a scanner with the name of another sensor.
    """

    def __init__(
        self,
        scanners: Sequence[str],
        *,
        with_camera: bool,
        lost_after_s: float,
        with_depth: bool = False,
    ) -> None:
        names = (*([CAMERA] * with_camera), *([DEPTH] * with_depth), *scanners)
        taken = [name for name, count in Counter((CAMERA, DEPTH, *scanners)).items() if count > 1]
        if taken:
            raise NavError(
                f"each scanner must have a name of its own, other than {CAMERA!r} and {DEPTH!r}, "
                f"got {taken[0]!r} again: rename its topic"
            )
        self._scanners, self.lost_after_s = tuple(scanners), lost_after_s
        self._sensors = {name: Sensor(name) for name in names}
        self._first_image_s, self._depth_unused, self._image_unused = math.inf, "", ""
        self._field = (0.0, AHEAD_RAD)
        self.seen = SeenDirections()
        # With the pictures of a camera that may be frozen.
        self._maybe = SeenDirections()

    def saw_image(self, stamp_s: float, camera: Camera, T_base_camera: FloatArray | None) -> None:
        """Note an image, and the camera's pose (4, 4); None leaves its field as it was."""
        self._first_image_s = min(self._first_image_s, stamp_s)
        self._saw(CAMERA, stamp_s)
        if T_base_camera is not None:
            self._field = camera_field(camera, T_base_camera)
        self.seen.note_field(*self._field, stamp_s)
        self._maybe.note_field(*self._field, stamp_s)

    def saw_same_image(self, stamp_s: float) -> None:
        """Note a picture that repeats the one before, of a robot that has not moved since.

        It may be of a simulated camera without noise, before which nothing moves. The robot may
        creep then, as where no sensor sees: the first step shows whether the camera lives.
        """
        if self._sensors[CAMERA].heard:
            self._saw(CAMERA, stamp_s)
            self._maybe.note_field(*self._field, stamp_s)

    def image_unused(self, why: str) -> None:
        """Note why the latest image cannot be used."""
        self._image_unused = why

    def saw_depth(self, stamp_s: float) -> None:
        """Note a depth image that was used."""
        self._saw(DEPTH, stamp_s)
        self._depth_unused = ""

    def depth_unused(self, why: str) -> None:
        """Note why the latest depth images cannot be used."""
        self._depth_unused = why

    def saw_scan(self, number: int, stamp_s: float, sight: ScannerSight) -> None:
        """Note a scan of a scanner, and where it shows what is there."""
        name, blind = self._scanners[number], sight.blind_text
        since_s = min(self._sensors[name].blind_since_s, stamp_s) if blind else math.inf
        self._sensors[name] = replace(self._sensors[name], blind=blind, blind_since_s=since_s)
        if not sight.nothing:
            self._saw(name, stamp_s)
            self.seen.note(sight, stamp_s)
            self._maybe.note(sight, stamp_s)

    @property
    def stamp_s(self) -> float | None:
        """Time from which perception is: of the camera, or of sensors that see all of its field.

        Without a camera the field is 60° to either side of straight ahead. None if nothing has seen
        the field.
        """
        return self._maybe.stamp_s(*self._field)

    @property
    def missing_text(self) -> str:
        """The first sensor that nothing of use has come from yet, in words; empty without.

        Of a camera whose images come and cannot be used, it says why the latest cannot.
        Depth images are not waited for: the camera goes on without them.
        """
        for each in self._sensors.values():
            if not each.heard and each.name != DEPTH:
                if each.name != CAMERA:
                    return f"no scan yet from {each.name!r}"
                unused = self._image_unused
                return f"no usable camera frame yet: {unused}" if unused else "no camera frame yet"
        return ""

    @property
    def blind_text(self) -> str:
        """The scanners that are blind and their sectors, in words; empty if there are none."""
        blind = [each for each in self._sensors.values() if each.blind]
        return "; ".join(f"{each.name}: {each.blind}" for each in blind)

    def ages_s(self, now_s: float) -> dict[str, float]:
        """Return the age of the latest frame of every sensor; infinite before the first."""
        return {each.name: max(0.0, now_s - each.stamp_s) for each in self._sensors.values()}

    def lost(self, now_s: float) -> tuple[str, ...]:
        """Return the sensors that have been silent for too long."""
        ages_s = self.ages_s(now_s).items()
        return tuple(name for name, age_s in ages_s if age_s > self.lost_after_s)

    def news(self, now_s: float) -> list[str]:
        """Return a line for every sensor that has been lost, or has come back, since last asked.

        So is one that has become blind, in a sector or all of it. A sensor that has never been
        heard is no news, but for depth images, once the camera has been at work for so long.
        """
        lost, lines, back = set(self.lost(now_s)), [], []
        for name, sensor in self._sensors.items():
            trouble, what = "", ""
            blind_s = now_s - sensor.blind_since_s
            if sensor.blind and (name in lost or blind_s > self.lost_after_s):
                trouble = "all blind" if name in lost else "blind"
                what = f"{name}: {sensor.blind}"
            elif name in lost and sensor.heard:
                trouble = "silent"
                have = "have" if name == DEPTH else "has"
                what = f"{name} {have} been silent for {now_s - sensor.stamp_s:.1f} s"
            late = now_s - self._first_image_s > self.lost_after_s
            if name == DEPTH and name in lost and late and (self._depth_unused or not what):
                trouble, what = "silent", f"{name}: {self._depth_unused or 'none has come'}"
            if trouble and trouble != sensor.trouble:
                lines.append(f"{what}: {self._consequence(lost, now_s)}")
            elif sensor.trouble and not trouble:
                back.append(f"{name} {'are' if name == DEPTH else 'is'} back")
            self._sensors[name] = replace(sensor, trouble=trouble)
        return lines + back

    def forget(self) -> None:
        """Forget all that was seen."""
        self._first_image_s, self._depth_unused, self._image_unused = math.inf, "", ""
        self._sensors = {name: Sensor(name) for name in self._sensors}
        self.seen, self._maybe = SeenDirections(), SeenDirections()

    def _saw(self, name: str, stamp_s: float) -> None:
        sensor = self._sensors[name]
        self._sensors[name] = replace(sensor, stamp_s=max(stamp_s, sensor.stamp_s))

    def _consequence(self, lost: set[str], now_s: float) -> str:
        left = [name for name in self._sensors if name not in lost and name != DEPTH]
        seen_s = self.stamp_s
        if not left or seen_s is None or now_s - seen_s > self.lost_after_s:
            return "the robot stops"
        goes_on = f"{' and '.join(left)} {'goes' if len(left) == 1 else 'go'} on"
        if CAMERA in lost:
            return f"{goes_on}, and everybody counts as unaware"
        if DEPTH in lost:
            return f"{goes_on}, and distances are less sure"
        return goes_on
