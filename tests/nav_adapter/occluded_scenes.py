"""A person before a scanner in a hall, and things that come between, for tests of the limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from nav_scenes import ROBOT, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from perception import PersonObservation
from perception.laser import LaserScan, RobotMotion, Scanner, scan_points
from tracking import PersonTracker, ScannerView, SensorConfig, TrackerConfig

PERIOD_S = 0.05
STEP_RAD = math.radians(0.5)
ANGLES_RAD = math.radians(-135.0) + STEP_RAD * np.arange(541)
SCANNER = Scanner.mounted(0.3, 0.0, 0.2)
ORIGIN_M = np.array([0.3, 0.0])
POLICY = AwarenessPolicy.preset("balanced")
SEEN_S = 3.0

Ranges = np.ndarray
#: Changes the ranges of the scan with this number.
Change = Callable[[Ranges, int], Ranges]


def hall(half_m: float = 8.0) -> Ranges:
    """Return the ranges in a square hall around the scanner."""
    return half_m / np.maximum(np.abs(np.cos(ANGLES_RAD)), np.abs(np.sin(ANGLES_RAD)))


def wall_between(at_m: float, low_m: float, high_m: float) -> Ranges:
    """Return the ranges of a flat side across the way, ``at_m`` ahead of the scanner."""
    cos = np.maximum(np.cos(ANGLES_RAD), 1e-9)
    y = at_m * np.tan(ANGLES_RAD)
    hit = (np.cos(ANGLES_RAD) > 0.02) & (y >= low_m) & (y <= high_m)
    return np.where(hit, at_m / cos, np.inf)


def gap_m(ranges: Ranges, place_m: np.ndarray, half_m: float = 0.25) -> float:
    """Return the widest part of a body at a place that no ray has passed."""
    to = place_m - ORIGIN_M
    along = to[0] * np.cos(ANGLES_RAD) + to[1] * np.sin(ANGLES_RAD)
    across = to[1] * np.cos(ANGLES_RAD) - to[0] * np.sin(ANGLES_RAD)
    past = (along > 0.0) & (np.abs(across) < half_m)
    past &= np.isfinite(ranges) & (ranges > along + half_m) & (ranges <= 20.0)
    return float(np.diff(np.sort([-half_m, half_m, *across[past]])).max())


@dataclass(frozen=True)
class Cycle:
    """One cycle after the person was shown for the last time."""

    constraints: NavConstraints
    place_empty: bool
    tracked: bool
    gap_m: float


def after_vanishing(place_m: tuple[float, float], change: Change, seconds: float) -> list[Cycle]:
    """Show a standing person for 3 s, then scans that are changed and show nobody."""
    tracker = PersonTracker(
        TrackerConfig(awareness=POLICY.filter),
        sensors={"laser": SensorConfig(view=ScannerView())},
    )
    adapter = NavAdapter(POLICY, ROBOT)
    place, T = np.array(place_m), SCANNER.T_base_scanner
    cycles = []
    for number in range(round((SEEN_S + seconds) / PERIOD_S)):
        now = PERIOD_S * number
        shown = now < SEEN_S
        ranges = hall() if shown else change(hall(), number)
        scan = LaserScan(now, float(ANGLES_RAD[0]), STEP_RAD, ranges, 0.05, 20.0)
        points = scan_points(scan, SCANNER, RobotMotion(now, np.eye(4)))
        people = [_observed(now, place - T[:2, 3])] if shown else []
        view = ScannerView(8.0, 0.1, math.radians(270.5), points)
        tracks = tracker.update(people, now, T, sensor="laser", view=view)
        constraints = adapter.update(tracks, robot_at(now), now, perception_stamp_s=now)
        if now >= SEEN_S - 1.5 * PERIOD_S:
            empty = any(track.place_empty for track in tracks)
            cycles.append(Cycle(constraints, empty, bool(tracks), gap_m(ranges, place)))
    return cycles


def largest_rise_mps2(cycles: list[Cycle]) -> float:
    limits = [each.constraints.speed_limit_mps for each in cycles]
    return float(np.diff(limits).max() / PERIOD_S)


def _observed(now: float, offset_m: np.ndarray) -> PersonObservation:
    return PersonObservation(
        stamp_s=now,
        position_camera_m=np.array([*offset_m, 0.0]),
        position_covariance_m2=np.diag([0.03, 0.03, 0.03]) ** 2,
        gaze_camera=None,
        awareness=None,
        awareness_std=None,
        score=0.9,
    )
