"""People whom a scanner cannot see: their place is not empty before rays have passed it.

Hazard H24 and claim C31 of docs/safety.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
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
        TrackerConfig(awareness=POLICY.filter), sensors={"laser": SensorConfig(view=ScannerView())}
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


RISE_MPS2 = 0.7
PLACE_M = (2.0, 0.0)


def sector(low_deg: float, high_deg: float, value: float):
    inside = np.clip(ANGLES_RAD, np.radians(low_deg), np.radians(high_deg)) == ANGLES_RAD
    return lambda ranges, number: np.where(inside, value, ranges)


def side(at_m: float, low_m: float, high_m: float):
    return lambda ranges, number: np.minimum(ranges, wall_between(at_m, low_m, high_m))


def test_a_place_that_rays_have_passed_is_free_at_once() -> None:
    assert POLICY.timing.lost_rise_mps2 == RISE_MPS2
    cycles = after_vanishing(PLACE_M, lambda ranges, number: ranges, 2.0)
    assert largest_rise_mps2(cycles) > 10.0
    assert cycles[-1].constraints.speed_limit_mps == ROBOT.max_speed_mps
    assert any(each.place_empty for each in cycles)


@pytest.mark.parametrize(
    "change", [side(0.7, -1.5, 1.5), sector(-20.0, 20.0, math.inf)], ids=["truck", "dark clothes"]
)
def test_what_no_ray_has_passed_is_not_empty(change) -> None:
    cycles = after_vanishing(PLACE_M, change, 9.0)
    assert not any(each.place_empty for each in cycles)
    assert largest_rise_mps2(cycles) <= RISE_MPS2 + 1e-6
    # It costs time, and not for ever.
    assert cycles[-1].constraints.speed_limit_mps == ROBOT.max_speed_mps


def test_hidden_people_are_kept_as_out_of_view_and_free_once_rays_pass() -> None:
    hidden = side(0.7, -1.5, 1.5)
    cycles = after_vanishing(
        PLACE_M, lambda ranges, number: hidden(ranges, number) if number < 120 else ranges, 5.5
    )
    # 3 s behind the truck, which then drives away: no longer than max_missed_s from there on.
    assert all(each.tracked for each in cycles[:60])
    assert not any(each.place_empty for each in cycles[:60])
    assert cycles[-1].constraints.speed_limit_mps == ROBOT.max_speed_mps
    assert largest_rise_mps2(cycles) > 10.0


def test_single_lost_rays_do_not_hide_that_a_place_is_empty() -> None:
    def lossy(ranges: Ranges, number: int) -> Ranges:
        return np.where(np.random.default_rng(number).random(len(ranges)) < 0.01, np.nan, ranges)

    assert largest_rise_mps2(after_vanishing(PLACE_M, lossy, 2.0)) > 10.0


@st.composite
def obstructions(draw: st.DrawFn):
    """Return what a scanner may meet or miss: blind sectors, sides, panes of glass, lost rays."""
    changes = []
    for _ in range(draw(st.integers(0, 2))):
        low = draw(st.floats(-60.0, 50.0))
        value = draw(st.sampled_from((math.nan, 0.0, math.inf, -math.inf, 65.5, 0.06)))
        changes.append(sector(low, low + draw(st.floats(1.0, 60.0)), value))
    for _ in range(draw(st.integers(0, 2))):
        left = draw(st.floats(-2.0, 1.5))
        right = left + draw(st.floats(0.05, 3.0))
        changes.append(side(draw(st.floats(0.3, 2.5)), left, right))
    if draw(st.booleans()):
        # Of a pane of glass only the rays that meet it squarely come back.
        left = draw(st.floats(-0.3, 0.2))
        changes.append(side(draw(st.floats(0.4, 1.5)), left, left + draw(st.floats(0.02, 0.2))))
    lost, seed = draw(st.sampled_from((0.0, 0.01, 0.3, 0.6))), draw(st.integers(0, 999))

    def change(ranges: Ranges, number: int) -> Ranges:
        for each in changes:
            ranges = each(ranges, number)
        dropped = np.random.default_rng([seed, number]).random(len(ranges)) < lost
        return np.where(dropped, math.inf, ranges)

    return change


@settings(max_examples=8, deadline=None)
@given(st.floats(1.2, 3.5), st.floats(-25.0, 25.0), obstructions())
def test_the_limit_rises_slowly_unless_rays_have_passed_the_place(range_m, bearing_deg, change):
    bearing = math.radians(bearing_deg)
    place = (0.3 + range_m * math.cos(bearing), range_m * math.sin(bearing))
    cycles = after_vanishing(place, change, 8.0)
    for before, after in pairwise(cycles):
        # What is said of a place was seen in the cycle before; a body is 0.5 m wide.
        if before.gap_m > 0.12:
            assert not before.place_empty
            assert largest_rise_mps2([before, after]) <= RISE_MPS2 + 1e-6
