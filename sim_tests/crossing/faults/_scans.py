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
from ._scanner_fault import NO_ANSWERS, BlindSector, ScannerFault

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
        blind = _Blindness(fault.scanner.blind, common_rng)
        self._scanners = [
            _FaultyScanner(
                fault.scanner,
                spec.scanner(),
                blind,
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


class _Blindness:
    """The sector of an episode in which no scanner gets an answer."""

    def __init__(self, sector: BlindSector, rng: np.random.Generator) -> None:
        drawn_deg = float(rng.uniform(-180.0, 180.0))
        begins, form = rng.random(2).tolist()
        at_deg = drawn_deg if sector.at_deg is None else sector.at_deg
        self._width_deg, self._middle_rad = sector.width_deg, math.radians(at_deg)
        self._begins_s = sector.begins_s(begins)
        drawn = NO_ANSWERS[int(form * len(NO_ANSWERS))]
        self._returns = drawn if sector.returns == "any" else sector.returns

    def blinded(self, scan: LaserScan, t_s: float, mounting: Scanner) -> LaserScan:
        """Return a scan taken at ``t_s`` without the answers of the sector."""
        if self._width_deg == 0.0 or t_s < self._begins_s:
            return scan
        directions = np.column_stack((np.cos(scan.angles_rad), np.sin(scan.angles_rad)))
        x, y = (mounting.T_base_scanner[:2, :2] @ directions.T).tolist()
        off = np.arctan2(y, x) - self._middle_rad
        inside = np.cos(off) >= math.cos(math.radians(0.5 * self._width_deg)) - 1e-9
        no_answer = {
            "inf": math.inf,
            "max": scan.range_max_m,
            "nan": math.nan,
            "zero": 0.0,
            "minus_inf": -math.inf,
            "below_min": 0.5 * scan.range_min_m,
            "above_max": 2.0 * scan.range_max_m,
        }[self._returns]
        return replace(scan, ranges_m=np.where(inside, no_answer, scan.ranges_m))


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
        blind: _Blindness,
        rngs: Sequence[np.random.Generator],
    ) -> None:
        timing_rng, self._drop_rng, self._noise_rng, mirror_rng, legs_rng = rngs
        self._fault, self._mounting, self._blind = fault, mounting, blind
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
        scan = self._blind.blinded(scan, motion.stamp_s, self._mounting)
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

    def _new_mirror(self, rng: np.random.Generator, _: float) -> Mirror | None:
        assert self._seen is not None  # only called from change()
        return new_mirror(rng, self._seen.scan, self._seen.T_odom_scanner)

    def _new_legs(self, rng: np.random.Generator, t_s: float) -> Legs:
        assert self._seen is not None  # only called from change()
        return new_legs(rng, t_s, self._seen.T_odom_scanner[:2, 3])
