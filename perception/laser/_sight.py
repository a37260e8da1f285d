"""The directions in which a scan shows what is there, and those in which its scanner is blind."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .._camera import Camera
from ..arrays import FloatArray
from ._points import RobotMotion, ScanPoints, beams_of, scan_points
from ._scan import LaserScan, Scanner

#: A return this near to the scanner is of a cover: behind it the ray sees nothing.
COVER_M: Final = 0.10
#: So is every return within this distance if most of the rays end there: a bag, a tarpaulin.
WRAPPED_M: Final = 0.30
# A ray is blind if of those within this angle to either side more than half have no answer. So a
# gap of up to 15 degrees is no blindness; at 2 m it is as wide as a person.
_WITHIN_RAD: Final = math.radians(15.0)
# "Nothing there" (+inf) counts as an answer while this share of the rays meets something: a scanner
# that measures nothing at all may publish it as well.
_ALIVE_SHARE: Final = 0.01
# So many rays with one range beyond the longest are a code of the driver, and no measurement.
_CODED: Final = 3
#: A robot without a camera must see this far to either side of straight ahead.
AHEAD_RAD: Final = math.radians(60.0)
# Directions in the base frame for which it is known when they were last seen.
_BEARINGS_RAD: Final = np.radians(np.arange(360.0))
_FULL_TURN_RAD: Final = 2.0 * math.pi
# A camera whose axis is steeper than this looks everywhere.
_STEEP: Final = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class ScannerSight:
    """The rays of one scan that show what is there.

    A ray has an answer if it met something that is not the robot's own body and no cover, or if it
    met nothing (+inf, REP-117) while other rays met something. NaN, -inf, 0, what is nearer than
    the shortest range, and a code beyond the longest one (three rays or more have this number) are
    no answers.

    Attributes:
        scan: the scan.
        scanner: its mounting.
        seen: (N,) True for rays in the field of view around which at most half have no answer.
        blind: (N,) True for the other rays in the field of view, but for those that end on the
            robot's own body, farther away than a cover.
    """

    scan: LaserScan
    scanner: Scanner
    seen: NDArray[np.bool_]
    blind: NDArray[np.bool_]

    @property
    def nothing(self) -> bool:
        """True if the scan shows nothing at all, as if it had not been published."""
        return not self.seen.any()

    def sees(self, bearings_base_rad: FloatArray) -> NDArray[np.bool_]:
        """Return (K,) whether the scan shows what is in directions (K,) of the base frame."""
        scan = self.scan
        near, within = _nearest_rays(
            self.scanner,
            scan.angle_min_rad,
            scan.angle_increment_rad,
            len(scan),
            bearings_base_rad,
        )
        return np.asarray(self.seen[near] & within)

    @property
    def blind_sectors_base_rad(self) -> tuple[tuple[float, float], ...]:
        """The blind sectors: from one bearing in the base frame counter-clockwise to another.

        Sectors less than 15 degrees apart are given as one.
        """
        if not self.blind.any():
            return ()
        shift = 0
        if _is_full_turn(self.scan) and not self.blind.all():
            shift = int(np.argmin(self.blind))
        blind = np.roll(self.blind, -shift)
        edges = np.flatnonzero(np.diff(np.concatenate(([False], blind, [False])).astype(np.int8)))
        mount = self.scanner.T_base_scanner[:2, :2]
        flipped = (np.linalg.det(mount) < 0.0) != (self.scan.angle_increment_rad < 0.0)
        apart = _WITHIN_RAD / abs(self.scan.angle_increment_rad)
        runs: list[list[int]] = []
        for first, end in edges.reshape(-1, 2).tolist():
            if runs and first - runs[-1][1] < apart:
                runs[-1][1] = end - 1
            else:
                runs.append([first, end - 1])
        # To the middle between the last ray that is blind and the next.
        rays = np.array(runs) + shift + (-0.5, 0.5)
        angles = self.scan.angle_min_rad + self.scan.angle_increment_rad * rays
        x, y = mount @ np.stack((np.cos(angles), np.sin(angles))).reshape(2, -1)
        sides = np.arctan2(y, x).reshape(-1, 2)
        return tuple((low, high) for low, high in sides[:, :: -1 if flipped else 1].tolist())

    @property
    def blind_text(self) -> str:
        """The blind sectors in words, for example ``blind from -45° to 45°``; empty without.

        Bearings are those of the base frame: 0 is ahead, to the left is positive.
        """
        if self.nothing:
            return f"blind ({self._why_nothing()})"
        sectors = [
            f"from {math.degrees(low):.0f}° to {math.degrees(high):.0f}°"
            for low, high in self.blind_sectors_base_rad
        ]
        return f"blind {' and '.join(sectors)}" if sectors else ""

    def _why_nothing(self) -> str:
        inside = self.scanner.sees(self.scan)
        ranges = self.scan.ranges_m[inside]
        if not len(ranges):
            return "none of its rays lies in its field of view"
        if np.mean(self.scan.no_return[inside]) > 0.5:
            return "its rays meet nothing, which a scanner that measures nothing may publish too"
        if np.mean(self.scan.measured[inside] & (ranges < WRAPPED_M)) > 0.5:
            return f"its rays end within {WRAPPED_M:.2f} m, as under a cover"
        return "most of its rays have no answer"


class SeenDirections:
    """The time at which the sensors of a robot last saw what is in each direction.

    A scanner that is blind has not seen what is there, as if it were silent.
    """

    def __init__(self) -> None:
        self._seen_s = np.full(len(_BEARINGS_RAD), -math.inf)

    def note(self, sight: ScannerSight, stamp_s: float) -> None:
        """Note a scan of any scanner."""
        scan = sight.scan
        near, within = _nearest_to_degrees(
            sight.scanner, scan.angle_min_rad, scan.angle_increment_rad, len(scan)
        )
        seen_s = np.where(sight.seen[near] & within, stamp_s, -math.inf)
        np.maximum(self._seen_s, seen_s, out=self._seen_s)

    def note_field(self, middle_rad: float, half_rad: float, stamp_s: float) -> None:
        """Note a picture of a camera, from its field as :func:`camera_field` returns it."""
        field = _sector(middle_rad, half_rad)
        self._seen_s[field] = np.maximum(self._seen_s[field], stamp_s)

    def stamp_s(self, middle_rad: float, half_rad: float) -> float | None:
        """Return the time from which all of a sector is; None if not all of it has been seen.

        Args:
            middle_rad: bearing of its middle in the base frame.
            half_rad: angle from there to either side.
        """
        oldest_s = float(self._seen_s[_sector(middle_rad, half_rad)].min())
        return oldest_s if math.isfinite(oldest_s) else None


def camera_field(camera: Camera, T_base_camera: FloatArray) -> tuple[float, float]:
    """Return the bearing in the base frame of a camera's axis, and the angle to its widest side.

    A camera that looks steeply down, or up, sees all directions.

    Args:
        camera: its calibration.
        T_base_camera: (4, 4) its pose.
    """
    x, y = T_base_camera[:2, 2].tolist()
    if math.hypot(x, y) < _STEEP:
        return 0.0, math.pi
    right, middle = camera.width_px - 0.5, camera.cy_px
    sides = camera.normalise([[-0.5, middle], [right, middle]], nearest=True)
    rays = np.column_stack((sides, np.ones(2))) @ T_base_camera[:3, :3].T
    bearing = math.atan2(y, x)
    off = np.remainder(np.arctan2(*rays.T[1::-1]) - bearing + math.pi, _FULL_TURN_RAD) - math.pi
    return bearing, float(np.abs(off).max())


@lru_cache(maxsize=16)
def _sector(middle_rad: float, half_rad: float) -> NDArray[np.bool_]:
    """Return which of the bearings are in a sector: at least the one nearest to its middle."""
    off = np.remainder(_BEARINGS_RAD - middle_rad + math.pi, _FULL_TURN_RAD) - math.pi
    inside = np.abs(off) <= max(half_rad, float(np.abs(off).min())) + 1e-9
    inside.setflags(write=False)
    return np.asarray(inside)


def _nearest_rays(
    scanner: Scanner,
    angle_min_rad: float,
    increment_rad: float,
    count: int,
    bearings_base_rad: FloatArray,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the ray (K,) nearest to each bearing, and whether it is at most half a ray away."""
    ahead = np.stack((np.cos(bearings_base_rad), np.sin(bearings_base_rad)))
    x, y = scanner.T_base_scanner[:2, :2].T @ ahead
    middle = 0.5 * (count - 1)
    off = np.arctan2(y, x) - (angle_min_rad + increment_rad * middle)
    # The number of the nearest ray, from -0.5 to half a ray after the last.
    ray = middle + (np.remainder(off + math.pi, _FULL_TURN_RAD) - math.pi) / increment_rad
    near = np.clip(np.rint(ray).astype(np.int64), 0, count - 1)
    return near, np.abs(ray - near) <= 0.5 + 1e-6


@lru_cache(maxsize=16)  # the scanners of a robot, scan after scan
def _nearest_to_degrees(
    scanner: Scanner, angle_min_rad: float, increment_rad: float, count: int
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the rays nearest to the directions for which is known when they were last seen."""
    return _nearest_rays(scanner, angle_min_rad, increment_rad, count, _BEARINGS_RAD)


def sight_of(scan: LaserScan, scanner: Scanner, points: ScanPoints | None = None) -> ScannerSight:
    """Return the directions in which a scan shows what is there.

    Args:
        scan: the scan.
        scanner: its mounting.
        points: of the scan, if they are known already.
    """
    if points is None:
        points = scan_points(scan, scanner, RobotMotion(scan.stamp_s, np.eye(4)))
    covered = beams_of(scanner, scan).covered
    far = scan.ranges_m >= COVER_M
    answered = (points.usable & far) | (covered & _beyond(scan))
    own = covered & scan.measured & ~points.usable & far
    wanted = np.count_nonzero(covered & ~own)
    wrapped = answered & (scan.ranges_m < WRAPPED_M)
    if 2 * np.count_nonzero(wrapped) > wanted:
        answered &= ~wrapped
    if np.count_nonzero(answered) >= _ALIVE_SHARE * wanted:
        answered |= covered & scan.no_return
    dead = covered & ~answered
    if not dead.any():
        return ScannerSight(scan, scanner, covered, dead)
    half = round(_WITHIN_RAD / abs(scan.angle_increment_rad))
    turn = _is_full_turn(scan)
    unseen = _with_dead_beside(
        covered & (2 * _near(dead, half, turn) > _near(covered, half, turn)), dead, turn
    )
    return ScannerSight(scan, scanner, covered & ~unseen, unseen & ~own)


def _beyond(scan: LaserScan) -> NDArray[np.bool_]:
    """Return (N,) True for rays that measured something beyond the longest range that counts."""
    beyond = (scan.ranges_m > scan.range_max_m) & ~scan.no_return
    if not beyond.any():
        return np.asarray(beyond)
    _, which, numbers = np.unique(scan.ranges_m[beyond], return_inverse=True, return_counts=True)
    beyond[beyond] = numbers[which] < _CODED
    return beyond


def _near(flags: NDArray[np.bool_], half: int, turn: bool) -> NDArray[np.int64]:
    """Return (N,) twice the number of flags set within ``half`` rays to either side of each.

    The outermost ones count half: every other ray is half of them, from wherever it is counted.
    """
    half = max(1, min(half, (len(flags) - 1) // 2 if turn else len(flags) - 1))
    none = np.zeros(half, dtype=np.bool_)
    before, after = (flags[len(flags) - half :], flags[:half]) if turn else (none, none)
    sums = np.cumsum(np.concatenate(([False], before, flags, after)), dtype=np.int64)
    wide = sums[2 * half + 1 :] - sums[: -2 * half - 1]
    return np.asarray(wide + sums[2 * half : -1] - sums[1 : -2 * half])


def _with_dead_beside(
    unseen: NDArray[np.bool_], dead: NDArray[np.bool_], turn: bool
) -> NDArray[np.bool_]:
    """Return (N,) with the rays without an answer that lie directly beside unseen ones."""
    either = unseen | dead
    if not unseen.any() or either.all():
        return either & unseen.any()
    shift = int(np.argmin(either)) if turn else 0
    rolled = np.roll(either, -shift)
    starts = np.diff(rolled.astype(np.int8), prepend=0) == 1
    runs = np.where(rolled, np.cumsum(starts), 0)
    wanted = np.unique(runs[np.roll(unseen, -shift)])
    return np.roll(np.isin(runs, wanted[wanted > 0]), shift)


def _is_full_turn(scan: LaserScan) -> bool:
    step = abs(scan.angle_increment_rad)
    return bool(step * len(scan) >= _FULL_TURN_RAD - 1.5 * step)
