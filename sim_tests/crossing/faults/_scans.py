"""Scans that are lost, late, frozen, blind or wrong on their way to the leg detector."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from perception.laser import LaserScan, RobotMotion, Scanner

from ...world.scanner import ScannerSpec
from ._false_returns import Appearing, Legs, Mirror, new_legs, new_mirror, with_legs, with_mirror
from ._fault import Fault
from ._scanner_fault import ScannerFault

_BLIND_RANGES: Final = {"inf": math.inf, "nan": math.nan}
# Streams of each scanner.
_STREAMS: Final = 5


class FaultyScans:
    """The scans of a robot's scanners with a fault.

    Args:
        fault: the fault.
        specs: the scanners.
        rng: random generator of the fault.
    """

    def __init__(
        self, fault: Fault, specs: Sequence[ScannerSpec], rng: np.random.Generator
    ) -> None:
        common_rng, *own = rng.spawn(1 + _STREAMS * len(specs))
        at_deg = fault.scanner.blind.at_deg
        drawn_deg = float(common_rng.uniform(-180.0, 180.0))
        blind_rad = math.radians(drawn_deg if at_deg is None else at_deg)
        self._scanners = [
            _FaultyScanner(
                fault.scanner,
                spec.scanner(),
                blind_rad,
                own[_STREAMS * number : _STREAMS * (number + 1)],
            )
            if fault.scanner.only in (None, number + 1)
            else None
            for number, spec in enumerate(specs)
        ]

    def change(
        self, scan: LaserScan, delivery_s: float, number: int, motion: RobotMotion
    ) -> tuple[LaserScan, float] | None:
        """Return the scan that is delivered instead of one, and its time; None for none.

        Args:
            scan: the scan that was taken.
            delivery_s: the time of its arrival.
            number: of its scanner, from 0.
            motion: true motion of the robot when the scan ended.
        """
        scanner = self._scanners[number]
        return (scan, delivery_s) if scanner is None else scanner.change(scan, delivery_s, motion)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """A scan as it was measured, and the pose of its scanner in odom (4, 4)."""

    scan: LaserScan
    T_odom_scanner: FloatArray


class _FaultyScanner:
    """One scanner with a fault."""

    def __init__(
        self,
        fault: ScannerFault,
        mounting: Scanner,
        blind_rad: float,
        rngs: Sequence[np.random.Generator],
    ) -> None:
        timing_rng, self._drop_rng, self._noise_rng, mirror_rng, legs_rng = rngs
        self._fault, self._mounting, self._blind_rad = fault, mounting, blind_rad
        freeze, death = timing_rng.random(2).tolist()
        self._first_freeze_s = freeze * fault.frozen.every_s
        within_s = fault.dies_within_s
        self._dies_s = math.inf if within_s is None else death * within_s
        self._mirrors = Appearing(fault.reflections, mirror_rng, self._new_mirror)
        self._legs = Appearing(fault.ghosts, legs_rng, self._new_legs)
        self._seen: _Seen | None = None
        self._last: LaserScan | None = None

    def change(
        self, scan: LaserScan, delivery_s: float, motion: RobotMotion
    ) -> tuple[LaserScan, float] | None:
        """Return the scan that is delivered, and its time; None for none."""
        # Every scan draws the same numbers, so that no part of the fault changes another.
        lost = float(self._drop_rng.random()) < self._fault.drop_rate
        noise = self._noise_rng.standard_normal(len(scan))
        T_odom_scanner = motion.T_odom_base @ self._mounting.T_base_scanner
        self._seen = _Seen(scan, T_odom_scanner)
        for mirror in self._mirrors.now(motion.stamp_s):
            scan = with_mirror(scan, mirror, T_odom_scanner)
        for legs in self._legs.now(motion.stamp_s):
            scan = with_legs(scan, legs, motion.stamp_s, T_odom_scanner, noise)
        scan = self._blinded(scan)
        if self._fault.frozen.holds(motion.stamp_s, self._first_freeze_s):
            if self._last is None:
                return None
            fresh = self._fault.frozen.fresh_stamps
            scan = replace(self._last, stamp_s=scan.stamp_s) if fresh else self._last
        else:
            self._last = scan
        if lost or motion.stamp_s >= self._dies_s:
            return None
        stamped = replace(scan, stamp_s=scan.stamp_s + self._fault.clock_error_s)
        return stamped, delivery_s + self._fault.latency_s

    def _blinded(self, scan: LaserScan) -> LaserScan:
        blind = self._fault.blind
        if blind.width_deg == 0.0:
            return scan
        directions = np.column_stack((np.cos(scan.angles_rad), np.sin(scan.angles_rad)))
        x, y = (self._mounting.T_base_scanner[:2, :2] @ directions.T).tolist()
        off = np.arctan2(y, x) - self._blind_rad
        inside = np.cos(off) >= math.cos(math.radians(0.5 * blind.width_deg)) - 1e-9
        nothing = _BLIND_RANGES.get(blind.returns, scan.range_max_m)
        return replace(scan, ranges_m=np.where(inside, nothing, scan.ranges_m))

    def _new_mirror(self, rng: np.random.Generator, _: float) -> Mirror | None:
        assert self._seen is not None  # only called from change()
        return new_mirror(rng, self._seen.scan, self._seen.T_odom_scanner)

    def _new_legs(self, rng: np.random.Generator, t_s: float) -> Legs:
        assert self._seen is not None  # only called from change()
        return new_legs(rng, t_s, self._seen.T_odom_scanner[:2, 3])
