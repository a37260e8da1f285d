"""A watch over the sensors at work, and whether they see enough to drive on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception import Camera
from perception.arrays import FloatArray

CAMERA: Final = "camera"
#: The camera's depth images, without which it goes on.
DEPTH: Final = "depth images"
# Without a camera, scanners must see this far to either side of straight ahead.
_AHEAD_RAD: Final = math.radians(60.0)
# Directions are compared at this distance.
_STEP_RAD: Final = math.radians(1.0)
# A camera whose axis is steeper than this looks everywhere.
_STEEP: Final = 0.2


class SensorWatch:
    """Keeps the latest stamp and the field of every sensor. One thread at a time may use it.

    While the camera is lost, scanners replace it only if they see all of its field: the robot must
    not drive on with less in view than the camera alone would have.

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
        self._needed_rad = (0.0, _AHEAD_RAD)
        self._stamps_s: dict[str, float] = {}
        self._fields_rad: dict[str, tuple[float, float]] = {}
        self._reported: set[str] = set()

    def saw_image(self, stamp_s: float, camera: Camera, T_base_camera: FloatArray | None) -> None:
        """Note an image, and the camera's pose (4, 4); None leaves its field as it was."""
        self._stamps_s[CAMERA] = max(stamp_s, self._stamps_s.get(CAMERA, -math.inf))
        if T_base_camera is not None:
            self._needed_rad = _field_of(camera, T_base_camera)

    def saw_depth(self, stamp_s: float) -> None:
        """Note a depth image that was used."""
        self._stamps_s[DEPTH] = max(stamp_s, self._stamps_s.get(DEPTH, -math.inf))

    def saw_scan(
        self, number: int, stamp_s: float, T_base_scanner: FloatArray, field_rad: float
    ) -> None:
        """Note a scan of a scanner whose x axis points to the middle of its field."""
        name = self._scanners[number]
        self._stamps_s[name] = max(stamp_s, self._stamps_s.get(name, -math.inf))
        bearing_rad = math.atan2(T_base_scanner[1, 0], T_base_scanner[0, 0])
        self._fields_rad[name] = bearing_rad, 0.5 * field_rad

    @property
    def stamp_s(self) -> float | None:
        """Time from which perception is: of the camera, or of scanners that see all of its field.

        Without a camera the field is 60° to either side of straight ahead. None if nothing has seen
        the field.
        """
        stamps = [self._scanners_stamp_s()]
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
        return f"no {missing} {'frame' if missing == CAMERA else 'scan'} yet"

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

        A sensor that has never been heard is no news.
        """
        lost = {name for name in self.lost(now_s) if name in self._stamps_s}
        lines = [
            f"{name} has been silent for {self.ages_s(now_s)[name]:.1f} s: "
            f"{self._consequence(lost)}"
            for name in self._names
            if name in lost - self._reported
        ]
        lines += [f"{name} is back" for name in self._names if name in (self._reported - lost)]
        self._reported = lost
        return lines

    def forget(self) -> None:
        """Forget all stamps."""
        self._stamps_s.clear()
        self._reported.clear()

    def _consequence(self, lost: set[str]) -> str:
        left = [name for name in self._names if name not in lost and name != DEPTH]
        if not left:
            return "the robot stops"
        goes_on = f"{' and '.join(left)} {'goes' if len(left) == 1 else 'go'} on"
        if CAMERA in lost:
            return f"{goes_on}, and everybody counts as unaware"
        if DEPTH in lost:
            return f"{goes_on}, and distances are less sure"
        return goes_on

    def _scanners_stamp_s(self) -> float | None:
        """Return the time from which scanners have seen all of the needed field."""
        middle, half = self._needed_rad
        bearings = middle + np.linspace(-half, half, 2 * math.ceil(half / _STEP_RAD) + 1)
        unseen = np.ones(len(bearings), dtype=np.bool_)
        newest_first = sorted(
            (
                (self._stamps_s[name], field)
                for name, field in self._fields_rad.items()
                if name in self._stamps_s
            ),
            reverse=True,
        )
        for stamp_s, (bearing, half_field) in newest_first:
            off = np.abs(np.remainder(bearings - bearing + math.pi, 2.0 * math.pi) - math.pi)
            unseen &= off > half_field + 1e-9
            if not unseen.any():
                return stamp_s
        return None


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
