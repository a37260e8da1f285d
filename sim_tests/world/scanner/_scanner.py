"""Scanners on a robot in a hall: their settings; exact ranges, then noise, dropouts and limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from perception.arrays import FloatArray
from perception.laser import LaserScan, RobotMotion, Scanner

from ..camera import CameraTiming
from ..config import SimConfig
from ._ray_cast import RayHits, cast_rays
from ._scene import SCENERY, Plane, ScanScene, SceneCut


class ScannerSpec(SimConfig):
    """A 2-D laser scanner on a robot; the defaults are those of a common safety scanner.

    Attributes:
        x_m: place ahead of the base frame's origin.
        y_m: place to its left.
        z_m: height above the floor.
        yaw_deg: direction of the scanner's x axis from the robot's, left positive.
        upside_down: its rays turn clockwise.
        field_of_view_deg: lowest and highest angle of its rays about its own z axis.
        resolution_deg: angle between rays.
        range_min_m: shortest range; what is nearer returns −inf.
        range_max_m: longest range; +inf without a return.
        noise_std_m: standard deviation of a range.
        dropout_rate: probability that a ray gives no return (+inf) from any surface.
        dark_dropout_rate: the same from black clothes, in addition; it falls to 0 at a reflectance
            of 30 %.
        timing: sweeps per second, losses and delays.
        scan_share: share of a turn's time that the mirror needs for a turn; 0 measures all rays at
            one instant, 1 is a mirror that turns at the rate of the sweeps.
    """

    x_m: float = 0.375
    y_m: float = 0.0
    z_m: float = Field(default=0.2, gt=0.0, le=2.0)
    yaw_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    upside_down: bool = False
    field_of_view_deg: tuple[float, float] = (-135.0, 135.0)
    resolution_deg: float = Field(default=0.375, ge=0.05, le=5.0)
    range_min_m: float = Field(default=0.05, ge=0.0)
    range_max_m: float = Field(default=20.0, gt=0.0, le=200.0)
    noise_std_m: float = Field(default=0.015, ge=0.0, le=0.5)
    dropout_rate: float = Field(default=0.001, ge=0.0, le=1.0)
    dark_dropout_rate: float = Field(default=0.1, ge=0.0, le=1.0)
    timing: CameraTiming = CameraTiming(rate_hz=25.0)
    scan_share: float = Field(default=1.0, ge=0.0, le=1.0)

    @model_validator(mode="after")
    def _in_order(self) -> ScannerSpec:
        low, high = self.field_of_view_deg
        if not low < high <= low + 360.0:
            raise ValueError(
                "field_of_view_deg must be the lowest and the highest angle, at most 360° apart, "
                f"got {low:g} and {high:g}"
            )
        if self.range_min_m >= self.range_max_m:
            raise ValueError(
                f"range_max_m must exceed range_min_m, got {self.range_max_m:g} and "
                f"{self.range_min_m:g} m"
            )
        return self

    @property
    def rays(self) -> int:
        """The number of rays of a sweep; a full turn does not repeat its first ray."""
        low, high = self.field_of_view_deg
        count = math.floor((high - low) / self.resolution_deg + 1e-9) + 1
        return min(count, max(round(360.0 / self.resolution_deg), 1))

    @property
    def time_increment_s(self) -> float:
        """The time from one ray to the next."""
        rate_hz = self.timing.rate_hz
        if rate_hz is None:
            return 0.0
        return self.scan_share * self.resolution_deg / 360.0 / rate_hz

    def scanner(self, body_base_m: FloatArray | None = None) -> Scanner:
        """Return the mounting, with the outline (M, 2) of the robot's body in the base frame."""
        low, high = self.field_of_view_deg
        return Scanner.mounted(
            self.x_m,
            self.y_m,
            self.z_m,
            math.radians(self.yaw_deg),
            upside_down=self.upside_down,
            field_of_view_rad=(math.radians(low), math.radians(high)),
            body_base_m=body_base_m,
        )


#: Two scanners of 270° on opposite corners of the robot, which together see all around.
DIAGONAL_SCANNERS: Final = (
    ScannerSpec(x_m=0.375, y_m=0.26, yaw_deg=45.0),
    ScannerSpec(x_m=-0.375, y_m=-0.26, yaw_deg=-135.0),
)


# Clothes that reflect at least this share of the light return every ray.
_DARK: Final = 0.3
# Decimals of the robot's own body in the frame of its scanner, in which it does not move.
_OWN_DIGITS: Final = 9


class SimulatedScanner:
    """A laser scanner that sees the surfaces of a scene.

    People stand still during one sweep. The robot moves with its body, and each ray starts where it
    is at its time.

    Args:
        scene: what it sees.
        spec: its settings.
        rng: draws noise and dropouts; every ray of every sweep draws the same number of values.

    Attributes:
        mounting: its place on the robot.
        hit_by: (N,) number of the actor that each ray of the last sweep met, −1 for the hall and
            for nothing; the truth, for tests and training.
    """

    def __init__(self, scene: ScanScene, spec: ScannerSpec, rng: np.random.Generator) -> None:
        self.scene, self.spec, self._rng = scene, spec, rng
        self.mounting: Scanner = spec.scanner()
        count = spec.rays
        self.hit_by: NDArray[np.int64] = np.full(count, SCENERY, dtype=np.int64)
        low, _ = np.radians(spec.field_of_view_deg).tolist()
        self._angle_min_rad: float = low
        self._increment_rad = math.radians(spec.resolution_deg)
        # The times of the rays before the last.
        self._times_s: FloatArray = np.arange(1.0 - count, 1.0) * spec.time_increment_s
        darkness = np.clip(1.0 - scene.reflectance / _DARK, 0.0, 1.0)
        self._lost: FloatArray = spec.dropout_rate + spec.dark_dropout_rate * darkness
        # What the rays meet of the robot's own body, which is the same sweep after sweep.
        self._own: tuple[FloatArray, RayHits] = (
            np.empty((0, 2, 2)),
            RayHits(np.full(count, np.inf), self.hit_by),
        )

    def scan(self, motion: RobotMotion) -> LaserScan:
        """Return the sweep whose last ray is measured at the robot's present pose.

        Args:
            motion: pose and velocity of the robot at the present time, its ``stamp_s``.
        """
        return scan_all([self], motion)[0]

    def _scan(self, motion: RobotMotion, T_odom_scanner: FloatArray, cut: SceneCut) -> LaserScan:
        """Return the sweep of what the plane of the scan cuts."""
        spec = self.spec
        exact, hits = self._met(cut.seen_from(T_odom_scanner), cut.others, motion)
        # The last entry is that of −1: a ray that meets nothing.
        self.hit_by = np.append(cut.numbers, SCENERY)[hits]
        noise, chance = self._rng.standard_normal(len(hits)), self._rng.random(len(hits))
        lost = chance < self._lost[self.hit_by]
        lost |= exact > spec.range_max_m
        noise *= spec.noise_std_m
        ranges = exact + noise
        ranges[lost | (ranges > spec.range_max_m)] = np.inf
        ranges[ranges < spec.range_min_m] = -np.inf
        return LaserScan(
            motion.stamp_s + float(self._times_s[0]),
            self._angle_min_rad,
            self._increment_rad,
            ranges,
            spec.range_min_m,
            spec.range_max_m,
            spec.time_increment_s,
        )

    def _met(self, segments_m: FloatArray, others: int, motion: RobotMotion) -> RayHits:
        """Return what the rays meet of segments (S, 2, 2); those from ``others`` on are its own."""
        angles = self._angle_min_rad, self._increment_rad
        origins, turns = self._seen_from(motion)
        exact, hits = cast_rays(segments_m[:others], *angles, origins, turns)
        own = np.round(segments_m[others:], _OWN_DIGITS)
        if not np.array_equal(own, self._own[0]):
            # The body moves with the scanner.
            still = np.zeros_like(origins)
            self._own = own, cast_rays(own, *angles, still, still[:, 0])
        body, rows = self._own[1]
        if len(own) and (rows >= 0).any():
            hits = np.where(body < exact, others + rows, hits)
            exact = np.minimum(exact, body)
        return RayHits(exact, hits)

    def _seen_from(self, motion: RobotMotion) -> tuple[FloatArray, FloatArray]:
        """Return origin (N, 2) and turn (N,) of every ray in the present frame of the scanner.

        The robot turns about its own z axis. A tilted scanner's rays leave its present plane by a
        second-order amount, which is neglected.
        """
        T = self.mounting.T_base_scanner
        stamps_s: FloatArray = motion.stamp_s + self._times_s
        arc = motion.arc(np.asarray(stamps_s - motion.stamp_s))
        x, y = T[:2, 3].tolist()
        moved = np.empty((len(self._times_s), 2))
        moved[:, 0] = arc.cos * x - arc.sin * y - x + arc.x_m
        moved[:, 1] = arc.sin * x + arc.cos * y - y + arc.y_m
        return moved @ T[:2, :2], arc.yaw_rad * T[2, 2]


def scan_all(scanners: Sequence[SimulatedScanner], motion: RobotMotion) -> list[LaserScan]:
    """Return the sweep of each scanner of one robot; see :meth:`SimulatedScanner.scan`.

    Scanners of one height and scene share most of the work.
    """
    cuts: dict[Plane, SceneCut] = {}
    scans = []
    for scanner in scanners:
        T = motion.T_odom_base @ scanner.mounting.T_base_scanner
        plane = Plane.through(T[:3, 3], T[:3, 2])
        if plane not in cuts:
            cuts[plane] = scanner.scene.cut(plane, T[:3, 3], _reach_m(scanners, scanner))
        scans.append(scanner._scan(motion, T, cuts[plane]))
    return scans


def _reach_m(scanners: Sequence[SimulatedScanner], at: SimulatedScanner) -> float:
    """Return the distance from one scanner beyond which no scanner measures anything."""
    place = at.mounting.T_base_scanner[:3, 3].tolist()
    return max(
        each.spec.range_max_m + math.dist(place, each.mounting.T_base_scanner[:3, 3].tolist())
        for each in scanners
    )
