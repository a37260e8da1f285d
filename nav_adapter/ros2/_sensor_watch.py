"""A watch over the sensors at work, and whether they see enough to drive on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray
from perception.laser import AHEAD_RAD, ScannerSight, SeenDirections

CAMERA: Final = "camera"
#: The camera's depth images, without which it goes on.
DEPTH: Final = "depth images"
# A camera whose axis is steeper than this looks everywhere.
_STEEP: Final = 0.2


class SensorWatch:
    """Keeps when every sensor last saw something, and where. One thread at a time may use it.

    A scan counts only where it shows what is there: what lies in the blind sectors of a scanner is
    as old as if the scanner were silent. While the camera is lost, scanners replace it only if they
    see all of its field: the robot must not drive on with less in view than the camera alone would
    have.

    Args:
        scanners: names of the scanners.
        with_camera: whether there is a camera.
        lost_after_s: a sensor that is silent for longer is lost.
        with_depth: whether the camera has depth images.
    """

    def __init__(
        self,
        scanners: Sequence[str],
        *,
        with_camera: bool,
        lost_after_s: float,
        with_depth: bool = False,
    ) -> None:
        self._scanners, self._lost_after_s = tuple(scanners), lost_after_s
        self._names = (*([CAMERA] * with_camera), *([DEPTH] * with_depth), *scanners)
        self._with_camera = with_camera
        self._needed_rad = (0.0, AHEAD_RAD)
        self._stamps_s: dict[str, float] = {}
        self._seen = SeenDirections()
        # Since when a scanner has been blind, and its sectors in words.
        self._blind: dict[str, tuple[float, str]] = {}
        self._reported: dict[str, str] = {}

    def saw_image(self, stamp_s: float, camera: Camera, T_base_camera: FloatArray | None) -> None:
        """Note an image, and the camera's pose (4, 4); None leaves its field as it was."""
        self._stamps_s[CAMERA] = max(stamp_s, self._stamps_s.get(CAMERA, -math.inf))
        if T_base_camera is not None:
            self._needed_rad = _field_of(camera, T_base_camera)

    def saw_depth(self, stamp_s: float) -> None:
        """Note a depth image that was used."""
        self._stamps_s[DEPTH] = max(stamp_s, self._stamps_s.get(DEPTH, -math.inf))

    def saw_scan(self, number: int, stamp_s: float, sight: ScannerSight) -> None:
        """Note a scan of a scanner, and where it shows what is there."""
        name, blind = self._scanners[number], sight.blind_text
        if blind:
            self._blind[name] = self._blind.get(name, (stamp_s,))[0], blind
        else:
            self._blind.pop(name, None)
        if sight.nothing:
            return
        self._stamps_s[name] = max(stamp_s, self._stamps_s.get(name, -math.inf))
        self._seen.note(sight, stamp_s)

    @property
    def stamp_s(self) -> float | None:
        """Time from which perception is: of the camera, or of scanners that see all of its field.

        Without a camera the field is 60° to either side of straight ahead. None if nothing has seen
        the field.
        """
        stamps = [self._seen.stamp_s(*self._needed_rad)]
        if self._with_camera:
            stamps.append(self._stamps_s.get(CAMERA))
        return max((each for each in stamps if each is not None), default=None)

    @property
    def missing(self) -> str | None:
        """The first sensor that nothing has come from yet; None if all have been heard."""
        return next((name for name in self._names if name not in self._stamps_s), None)

    @property
    def missing_text(self) -> str:
        """The first sensor that nothing has come from yet, in words; empty if there is none."""
        missing = self.missing
        if missing is None:
            return ""
        if missing == DEPTH:
            return "no depth image yet"
        return "no camera frame yet" if missing == CAMERA else f"no scan yet from {missing!r}"

    @property
    def blind_text(self) -> str:
        """The scanners that are blind and their sectors, in words; empty if there are none."""
        return "; ".join(f"{name}: {blind}" for name, (_, blind) in self._blind.items())

    def ages_s(self, now_s: float) -> dict[str, float]:
        """Return the age of the latest frame of every sensor; infinite before the first."""
        return {name: max(0.0, now_s - self._stamps_s.get(name, -math.inf)) for name in self._names}

    def lost(self, now_s: float) -> tuple[str, ...]:
        """Return the sensors that have been silent for too long."""
        return tuple(
            name for name, age_s in self.ages_s(now_s).items() if age_s > self._lost_after_s
        )

    def news(self, now_s: float) -> list[str]:
        """Return a line for every sensor that has been lost, or has come back, since last asked.

        So is one that has become blind, in a sector or all of it. A sensor that has never been
        heard is no news.
        """
        lost, ages_s = set(self.lost(now_s)), self.ages_s(now_s)
        troubles: dict[str, str] = {}
        lines = []
        for name in self._names:
            blind_since_s, blind = self._blind.get(name, (now_s, ""))
            if blind and (name in lost or now_s - blind_since_s > self._lost_after_s):
                troubles[name] = "all blind" if name in lost else "blind"
                what = f"{name}: {blind}"
            elif name in lost and name in self._stamps_s:
                troubles[name] = "silent"
                what = f"{name} has been silent for {ages_s[name]:.1f} s"
            if name in troubles and troubles[name] != self._reported.get(name):
                lines.append(f"{what}: {self._consequence(lost, now_s)}")
        lines += [f"{name} is back" for name in self._reported if name not in troubles]
        self._reported = troubles
        return lines

    def forget(self) -> None:
        """Forget all stamps."""
        self._stamps_s.clear()
        self._blind.clear()
        self._reported.clear()
        self._seen = SeenDirections()

    def _consequence(self, lost: set[str], now_s: float) -> str:
        left = [name for name in self._names if name not in lost and name != DEPTH]
        seen_s = self.stamp_s
        if not left or seen_s is None or now_s - seen_s > self._lost_after_s:
            return "the robot stops"
        goes_on = f"{' and '.join(left)} {'goes' if len(left) == 1 else 'go'} on"
        if CAMERA in lost:
            return f"{goes_on}, and everybody counts as unaware"
        if DEPTH in lost:
            return f"{goes_on}, and distances are less sure"
        return goes_on


def _field_of(camera: Camera, T_base_camera: FloatArray) -> tuple[float, float]:
    """Return the bearing in the base frame of a camera's axis, and the angle to its widest side."""
    axis = T_base_camera[:2, 2]
    if np.hypot(*axis) < _STEEP:
        return 0.0, math.pi
    right, middle = camera.width_px - 0.5, camera.cy_px
    sides = camera.normalise([[-0.5, middle], [right, middle]], nearest=True)
    rays = np.column_stack((sides, np.ones(2))) @ T_base_camera[:3, :3].T
    bearing = math.atan2(axis[1], axis[0])
    off = [
        abs(math.remainder(math.atan2(y, x) - bearing, 2.0 * math.pi)) for x, y, _ in rays.tolist()
    ]
    return bearing, max(off)
