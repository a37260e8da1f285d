"""Drivers that send range_max for a ray without a return hide nobody who stands near it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laser_scenes import laser_scan, points_of, two_legs

from perception.laser import LaserScan, LegDetector, Scanner, sight_of

RANGE_MAX_M = 4.0


def scan_of(ranges, range_max_m: float = RANGE_MAX_M) -> LaserScan:
    return LaserScan(0.0, -math.pi, math.radians(0.5), ranges, 0.1, range_max_m)


def seen_near_the_limit(nothing_m: float) -> int:
    """Return in how many of 40 scans somebody is found 15 cm within range_max, in a large hall."""
    detector, place, found = LegDetector(), np.array([3.85, 0.0]), 0
    for number in range(80):
        people = two_legs(*place) if number >= 40 else ()
        exact = laser_scan(people, noise=0.01, seed=number, stamp_s=0.1 * number)
        ranges = np.where(exact.ranges_m > RANGE_MAX_M, nothing_m, exact.ranges_m)
        scan = LaserScan(
            0.1 * number, exact.angle_min_rad, exact.angle_increment_rad, ranges, 0.05, RANGE_MAX_M
        )
        candidates = detector.detect(points_of(scan))
        found += any(np.hypot(*(each.position_odom_m[:2] - place)) < 0.5 for each in candidates)
    return found


@pytest.mark.parametrize(
    "nothing_m",
    [
        pytest.param(RANGE_MAX_M, id="range_max"),
        pytest.param(RANGE_MAX_M - 0.001, id="a millimetre less"),
        pytest.param(
            float(np.nextafter(np.float32(RANGE_MAX_M), np.float32(9.0))), id="rounded up"
        ),
        pytest.param(0.995 * RANGE_MAX_M, id="half a per cent less"),
        pytest.param(RANGE_MAX_M + 1.0, id="range_max + 1"),
        pytest.param(65.533, id="a code above range_max"),
    ],
)
def test_somebody_near_range_max_is_found_as_among_rays_of_infinity(nothing_m: float) -> None:
    assert seen_near_the_limit(nothing_m) >= 0.9 * seen_near_the_limit(math.inf) > 30


def test_rays_of_range_max_met_nothing() -> None:
    scan = scan_of([4.0, 4.0, 3.0, 4.0])
    assert scan.no_return.tolist() == [True, True, False, True]
    assert scan.measured.tolist() == [False, False, True, False]
    assert scan.free_of(scan.measured).tolist() == [4.0, 4.0, 3.0, 4.0]


def test_rays_of_0_measured_nothing_whatever_range_min_is() -> None:
    scan = LaserScan(0.0, 0.0, 0.01, [0.0, 0.05, 2.0, 0.0], 0.0, RANGE_MAX_M)
    assert scan.measured.tolist() == [False, True, True, False]
    assert scan.free_of(scan.measured).tolist() == [0.0, 0.05, 2.0, 0.0]
    dead = sight_of(LaserScan(0.0, 0.0, 0.01, [0.0] * 90, 0.0, 4.0), Scanner.mounted(0.0, 0.0, 0.2))
    assert dead.blind_text == "blind (most of its rays have no answer)"


def test_a_wall_at_range_max_is_still_a_wall() -> None:
    """Noise makes its ranges differ, also where a driver rounds them to millimetres."""
    rng = np.random.default_rng(0)
    ranges = RANGE_MAX_M - 0.02 + 0.01 * rng.standard_normal(300)
    within = ranges <= RANGE_MAX_M
    assert (scan_of(ranges).measured == within).all()
    rounded = scan_of(np.round(ranges, 3)).measured
    assert rounded.sum() > 0.9 * within.sum()
