"""Faults of the laser scanners."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from perception.arrays import FloatArray
from perception.laser import LaserScan

from .._messages import Change, Delivery, MountedScan
from ._sensor_fault import Appearances, Appearing, Onset, Outage, ScanFault, SensorFault, Start

# What a driver publishes for a ray without an answer.
_NO_ANSWERS: Final = ("inf", "minus_inf", "nan", "zero", "below_min", "above_max")
# Streams of scans: one that all scanners share, then five of each scanner.
_SCANS: Final = 2
_OUTAGES, _LOSSES, _NOISE, _MIRRORS, _LEGS = range(5)


def _rng(start: Start, use: int) -> np.random.Generator:
    return start.rng(_SCANS, 1 + 5 * start.number + use)


class Reflections(Appearing, ScanFault):
    """Surfaces that reflect rays like a mirror, 0.8 m wide, at something measured within 8 m.

    Beyond them the scan shows people, posts and racks a second time, mirrored; images of people
    move as the people do.
    """

    key: ClassVar[str] = "reflections"

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        rng = _rng(start, _MIRRORS)
        mirrors: Appearances[Mirror] = Appearances(self, rng)

        def change(taken: Delivery[MountedScan]) -> Delivery[MountedScan]:
            measured, T = taken.message.scan, taken.T_odom_sensor

            def appear(t_s: float) -> tuple[float, Mirror] | None:
                until_s = t_s + float(rng.exponential(self.for_s))
                mirror = new_mirror(rng, measured, T)
                return None if mirror is None else (until_s, mirror)

            scan = measured
            for mirror in mirrors.at(taken.taken_s, appear):
                scan = with_mirror(scan, mirror, T)
            return _with(taken, scan)

        return change


class LegGhosts(Appearing, ScanFault):
    """Pairs of legs that do not exist, 0.8 m to 6 m away.

    Half of them stand; the others walk at up to 1.5 m/s. They hide what is behind them.
    """

    key: ClassVar[str] = "ghosts"

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        rng, noise_rng = _rng(start, _LEGS), _rng(start, _NOISE)
        ghosts: Appearances[Legs] = Appearances(self, rng)

        def change(taken: Delivery[MountedScan]) -> Delivery[MountedScan]:
            scan, T = taken.message.scan, taken.T_odom_sensor

            def appear(t_s: float) -> tuple[float, Legs]:
                until_s = t_s + float(rng.exponential(self.for_s))
                return until_s, new_legs(rng, t_s, T[:2, 3])

            noise = noise_rng.standard_normal(len(scan))
            for legs in ghosts.at(taken.taken_s, appear):
                scan = with_legs(scan, legs, taken.taken_s, T, noise)
            return _with(taken, scan)

        return change


class BlindSector(Onset, ScanFault):
    """A sector in which no ray returns, as behind dirt on the window; the default has none.

    It begins at the same time for all scanners, and all are blind in the same direction, so that
    none of them replaces another.

    Attributes:
        width_deg: width of the sector; 0 for none, 360 for a scanner that sees nothing.
        at_deg: direction of its middle from the robot's heading, left positive; None draws it in
            each episode, evenly over the circle.
        returns: ``"inf"``: no return, as from empty space; ``"max"``: the longest range, as some
            drivers write it; ``"nan"``: an invalid measurement; ``"zero"``: 0; ``"minus_inf"``: too
            near; ``"below_min"``, ``"above_max"``: half the shortest and twice the longest range.
            ``"any"`` draws one of all but ``"max"`` in each episode.
    """

    key: ClassVar[str] = "blind"
    width_deg: float = Field(default=0.0, ge=0.0, le=360.0)
    at_deg: float | None = Field(default=None, ge=-180.0, le=180.0)
    returns: Literal["inf", "max", "nan", "zero", "minus_inf", "below_min", "above_max", "any"] = (
        "inf"
    )

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        rng = start.rng(_SCANS, 0)
        drawn_deg = float(rng.uniform(-180.0, 180.0))
        onset, form = rng.random(2).tolist()
        middle_rad = math.radians(drawn_deg if self.at_deg is None else self.at_deg)
        begins_s = self.begins_s(onset)
        returns = self.returns
        if returns == "any":
            returns = _NO_ANSWERS[int(form * len(_NO_ANSWERS))]
        rotation = start.scanner.scanner().T_base_scanner[:2, :2]
        least_cosine = math.cos(math.radians(0.5 * self.width_deg)) - 1e-9

        def change(taken: Delivery[MountedScan]) -> Delivery[MountedScan]:
            scan = taken.message.scan
            if self.width_deg == 0.0 or taken.taken_s < begins_s:
                return taken
            directions = np.column_stack((np.cos(scan.angles_rad), np.sin(scan.angles_rad)))
            x, y = (rotation @ directions.T).tolist()
            inside = np.cos(np.arctan2(y, x) - middle_rad) >= least_cosine
            ranges = np.where(inside, _no_answer_m(returns, scan), scan.ranges_m)
            return _with(taken, replace(scan, ranges_m=ranges))

        return change


def _no_answer_m(returns: str, scan: LaserScan) -> float:
    """Return the range that a driver publishes for a ray without an answer."""
    return {
        "inf": math.inf,
        "max": scan.range_max_m,
        "nan": math.nan,
        "zero": 0.0,
        "minus_inf": -math.inf,
        "below_min": 0.5 * scan.range_min_m,
        "above_max": 2.0 * scan.range_max_m,
    }[returns]


class FrozenScans(Outage, ScanFault):
    """A scanner that delivers its last scan again and again.

    With fresh stamps everything seems to move with the robot; with old ones the scanner falls
    silent.
    """

    key: ClassVar[str] = "frozen"

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        return self.frozen(float(_rng(start, _OUTAGES).random()), _restamped)


def _restamped(last: MountedScan, taken: MountedScan) -> MountedScan:
    return replace(last, scan=replace(last.scan, stamp_s=taken.scan.stamp_s))


class DeadScanner(ScanFault):
    """A scanner of which no scan arrives any more from a time on.

    Attributes:
        dies_within_s: the time is evenly distributed from 0 to this; 0 for a scanner that is dead
            from the start.
    """

    dies_within_s: float = Field(ge=0.0, le=600.0)

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        _, death = _rng(start, _OUTAGES).random(2).tolist()  # the first is of a freeze
        dies_s = death * self.dies_within_s
        return lambda taken: taken if taken.taken_s < dies_s else None


class LateScans(ScanFault):
    """Scans that arrive late or not at all; their stamps stay true.

    Attributes:
        drop_rate: share of the scans that never arrive.
        latency_s: delay of every scan.
    """

    drop_rate: float = Field(default=0.0, ge=0.0, le=1.0)
    latency_s: float = Field(default=0.0, ge=0.0, le=10.0)

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        rng = _rng(start, _LOSSES)

        def change(taken: Delivery[MountedScan]) -> Delivery[MountedScan] | None:
            if rng.random() < self.drop_rate:
                return None
            return replace(taken, arrives_s=taken.arrives_s + self.latency_s)

        return change


class WrongClock(ScanFault):
    """A clock of a scanner that is ahead or behind.

    The robot looks up its own pose at the wrong time as well.

    Attributes:
        clock_error_s: the clock is ahead by this; negative is behind.
    """

    clock_error_s: float = Field(ge=-10.0, le=10.0)

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""

        def change(taken: Delivery[MountedScan]) -> Delivery[MountedScan]:
            scan = taken.message.scan
            return _with(taken, replace(scan, stamp_s=scan.stamp_s + self.clock_error_s))

        return change


class TurnedScanner(ScanFault):
    """A scanner that does not look where the robot assumes it to look.

    Attributes:
        yaw_error_deg: the robot assumes that the scanner is turned this much farther to the left
            than it is.
    """

    yaw_error_deg: float = Field(ge=-180.0, le=180.0)

    def begin(self, start: Start) -> Change[MountedScan]:
        """Return the change of the scans of one scanner in one episode."""
        yaw_deg = start.scanner.yaw_deg + self.yaw_error_deg
        turned = start.scanner.model_copy(update={"yaw_deg": yaw_deg}).scanner(start.body_base_m)
        return lambda taken: replace(taken, message=MountedScan(taken.message.scan, turned))


def _with(taken: Delivery[MountedScan], scan: LaserScan) -> Delivery[MountedScan]:
    return replace(taken, message=MountedScan(scan, taken.message.mounting))


#: In the order in which they act on a scan: from the rays to the driver.
SCAN_FAULTS: Final[tuple[type[SensorFault], ...]] = (
    Reflections,
    LegGhosts,
    BlindSector,
    FrozenScans,
    DeadScanner,
    LateScans,
    WrongClock,
    TurnedScanner,
)


_MIRROR_WITHIN_M: Final = 8.0
_MIRROR_HALF_WIDTH_M: Final = 0.4
# A mirror's normal is at most so far from the direction to the scanner.
_MIRROR_TURN_RAD: Final = math.radians(45.0)
# A mirror is seen if nothing else returns from this much nearer.
_MIRROR_DEPTH_M: Final = 0.15
_LEG_RANGE_M: Final = (0.8, 6.0)
_LEG_RADIUS_M: Final = 0.06
_LEG_NOISE_M: Final = 0.015
_HALF_STANCE_M: Final = (0.06, 0.20)
_FASTEST_MPS: Final = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Mirror:
    """A mirror that stands in odom: its middle (2,) and its unit normal (2,)."""

    middle_odom_m: FloatArray
    normal_odom: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Two legs in odom: their middle (2,) at a time, their velocity, and half their distance (2,).

    ``appears_s`` is the time of the place.
    """

    middle_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    half_odom_m: FloatArray
    appears_s: float


def new_mirror(
    rng: np.random.Generator, scan: LaserScan, T_odom_scanner: FloatArray
) -> Mirror | None:
    """Return a mirror at a surface of the scan, turned about it; None without a surface."""
    chance, turn = rng.random(2).tolist()
    rays = np.flatnonzero(scan.measured & (scan.ranges_m <= _MIRROR_WITHIN_M))
    if not rays.size:
        return None
    ray = int(rays[int(chance * rays.size)])
    angle = float(scan.angles_rad[ray])
    middle = scan.ranges_m[ray] * np.array([math.cos(angle), math.sin(angle)])
    back = angle + math.pi + (2.0 * turn - 1.0) * _MIRROR_TURN_RAD
    rotation, origin = T_odom_scanner[:2, :2], T_odom_scanner[:2, 3]
    return Mirror(origin + rotation @ middle, rotation @ np.array([math.cos(back), math.sin(back)]))


def new_legs(rng: np.random.Generator, t_s: float, origin_odom_m: FloatArray) -> Legs:
    """Return legs about the scanner's place (2,)."""
    distance, bearing, stands, pace, course, stance, side = rng.random(7).tolist()
    near_m, far_m = _LEG_RANGE_M
    bearing, course, side = (math.tau * each for each in (bearing, course, side))
    speed_mps = 0.0 if stands < 0.5 else pace * _FASTEST_MPS
    low_m, high_m = _HALF_STANCE_M
    return Legs(
        origin_odom_m + (near_m + distance * (far_m - near_m)) * _unit(bearing),
        speed_mps * _unit(course),
        (low_m + stance * (high_m - low_m)) * _unit(side),
        t_s,
    )


def with_mirror(scan: LaserScan, mirror: Mirror, T_odom_scanner: FloatArray) -> LaserScan:
    """Return the scan with the mirror images of its own points beyond a mirror."""
    rotation, origin = T_odom_scanner[:2, :2], T_odom_scanner[:2, 3]
    middle = rotation.T @ (mirror.middle_odom_m - origin)
    normal = rotation.T @ mirror.normal_odom
    if middle @ normal >= 0.0:  # the scanner is behind the mirror
        return scan
    measured = np.flatnonzero(scan.measured)
    angles, ranges = scan.angles_rad, scan.ranges_m.copy()
    points = ranges[measured, None] * np.column_stack(
        (np.cos(angles[measured]), np.sin(angles[measured]))
    )
    above = (points - middle) @ normal
    points, above = points[above > _MIRROR_DEPTH_M], above[above > _MIRROR_DEPTH_M]
    images = points - 2.0 * above[:, None] * normal
    # Where the line from the scanner to the image meets the mirror.
    share = (middle @ normal) / (images @ normal)
    on_mirror = share[:, None] * images
    beside = np.hypot(*(on_mirror - middle).T)
    rays, distances = _rays(scan, images)
    seen = (rays >= 0) & (beside <= _MIRROR_HALF_WIDTH_M) & (distances <= scan.range_max_m)
    seen[seen] &= ranges[rays[seen]] >= np.hypot(*on_mirror[seen].T) - _MIRROR_DEPTH_M
    nearest = np.full(len(ranges), np.inf)
    np.minimum.at(nearest, rays[seen], distances[seen])
    return replace(scan, ranges_m=np.where(np.isfinite(nearest), nearest, ranges))


def with_legs(
    scan: LaserScan, legs: Legs, t_s: float, T_odom_scanner: FloatArray, noise: FloatArray
) -> LaserScan:
    """Return the scan with the nearer surfaces of two legs; ``noise`` is (N,), standard normal."""
    rotation, origin = T_odom_scanner[:2, :2], T_odom_scanner[:2, 3]
    middle = legs.middle_odom_m + (t_s - legs.appears_s) * legs.velocity_odom_mps
    ranges, angles = scan.ranges_m.copy(), scan.angles_rad
    for side in (-1.0, 1.0):
        x, y = (rotation.T @ (middle + side * legs.half_odom_m - origin)).tolist()
        along = x * np.cos(angles) + y * np.sin(angles)
        beside = np.abs(y * np.cos(angles) - x * np.sin(angles))
        depth = np.sqrt(np.maximum(_LEG_RADIUS_M**2 - beside**2, 0.0))
        surface = along - depth + _LEG_NOISE_M * noise
        meets = (beside < _LEG_RADIUS_M) & (along > _LEG_RADIUS_M)
        meets &= (surface >= scan.range_min_m) & (surface <= scan.range_max_m)
        # Rays without a return become shorter as well; NaN and -inf stay.
        ranges = np.where(meets & (ranges > surface), surface, ranges)
    return replace(scan, ranges_m=ranges)


def _rays(scan: LaserScan, points: FloatArray) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the ray (N,) nearest to each point (N, 2), −1 for none, and the point's range (N,)."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    step = scan.angle_increment_rad
    off = np.mod((angle - scan.angle_min_rad) * math.copysign(1.0, step), math.tau)
    rays = np.rint(off / abs(step)).astype(np.int64)
    return np.where(rays < len(scan), rays, -1), np.hypot(points[:, 0], points[:, 1])


def _unit(angle_rad: float) -> FloatArray:
    return np.array([math.cos(angle_rad), math.sin(angle_rad)])
