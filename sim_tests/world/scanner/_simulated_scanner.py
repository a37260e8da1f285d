"""A scanner on a robot in a hall: exact ranges, then noise, dropouts and limits."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from perception.laser import LaserScan, RobotMotion, Scanner

from ._ray_cast import cast_rays
from ._scene import SCENERY, ScanScene
from ._spec import ScannerSpec

# Clothes that reflect at least this share of the light return every ray.
_DARK: Final = 0.3


class SimulatedScanner:
    """A laser scanner that sees the surfaces of a scene.

    People stand still during one sweep. The robot moves with its body, and each ray starts where it
    is at its time.

    Args:
        scene: what it sees.
        spec: its settings.
        rng: draws noise and dropouts; every ray of every sweep draws the same number of values.

    Attributes:
        spec: as given.
        mounting: its place on the robot.
        hit_by: (N,) number of the actor that each ray of the last sweep met, −1 for the hall and
            for nothing; the truth, for tests and training.
    """

    def __init__(self, scene: ScanScene, spec: ScannerSpec, rng: np.random.Generator) -> None:
        self._scene, self.spec, self._rng = scene, spec, rng
        self.mounting: Scanner = spec.scanner()
        self.hit_by: NDArray[np.int64] = np.full(spec.rays, SCENERY, dtype=np.int64)

    def scan(self, motion: RobotMotion) -> LaserScan:
        """Return the sweep whose last ray is measured at the robot's present pose.

        Args:
            motion: pose and velocity of the robot at the present time, its ``stamp_s``.
        """
        spec, count = self.spec, self.spec.rays
        low, _ = np.radians(spec.field_of_view_deg).tolist()
        step = math.radians(spec.resolution_deg)
        before = np.arange(count, dtype=np.float64) - (count - 1)
        stamps = np.asarray(motion.stamp_s + spec.time_increment_s * before)
        T_base_scanner = self.mounting.T_base_scanner
        segments, owners = self._scene.cut(motion.T_odom_base @ T_base_scanner, spec.range_max_m)
        origins, turns = _seen_from(motion, stamps, T_base_scanner)
        own = self._scene.carrier[owners]
        if own.any():  # last, so that the others keep their rows
            order = np.argsort(own, kind="stable")
            segments, owners, own = segments[order], owners[order], own[order]
        others = len(own) - int(own.sum())
        exact, hits = cast_rays(segments[:others], low, step, origins, turns)
        if others < len(own):
            # The robot's own body moves with the scanner.
            still = np.zeros_like(origins)
            body, rows = cast_rays(segments[others:], low, step, still, still[:, 0])
            hits = np.where(body < exact, others + rows, hits)
            exact = np.minimum(exact, body)
        met = hits >= 0
        self.hit_by = np.where(met, owners[hits] if len(owners) else SCENERY, SCENERY)
        noise, chance = self._rng.standard_normal(count), self._rng.random(count)
        ranges = exact + spec.noise_std_m * noise
        darkness = np.clip(1.0 - self._scene.reflectance[self.hit_by] / _DARK, 0.0, 1.0)
        lost = spec.dropout_rate + spec.dark_dropout_rate * darkness
        ranges[(chance < lost) | (exact > spec.range_max_m)] = np.inf
        ranges[ranges > spec.range_max_m] = np.inf
        ranges[ranges < spec.range_min_m] = -np.inf
        return LaserScan(
            float(stamps[0]),
            low,
            step,
            ranges,
            spec.range_min_m,
            spec.range_max_m,
            spec.time_increment_s,
        )


def _seen_from(
    motion: RobotMotion, stamps_s: FloatArray, T_base_scanner: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return origin (N, 2) and turn (N,) of every ray in the present frame of the scanner.

    The robot turns about its own z axis. A tilted scanner's rays leave its present plane by a
    second-order amount, which is neglected.
    """
    yaw, moved = motion.poses_base(stamps_s)
    mount, offset = T_base_scanner[:3, :3], T_base_scanner[:3, 3]
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y = offset[:2].tolist()
    shift = np.column_stack(
        (cos * x - sin * y - x + moved[:, 0], sin * x + cos * y - y + moved[:, 1])
    )
    turned: FloatArray = yaw * mount[2, 2]
    return np.asarray(shift @ mount[:2, :2]), turned
