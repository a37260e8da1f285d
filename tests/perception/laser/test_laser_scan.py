"""Scans as ROS means them and as drivers send them, mountings, and the robot's motion."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laser_scenes import laser_scan, points_of, pose, two_legs

from perception.laser import LaserScan, LegDetector, RobotMotion, Scanner, scan_points

STEP = math.radians(0.5)
HOME = RobotMotion(0.0, np.eye(4))
ANGLES = st.floats(-3.0, 3.0)


def scan_of(ranges, **changes) -> LaserScan:
    fields = {
        "stamp_s": 0.0,
        "angle_min_rad": -math.pi,
        "angle_increment_rad": STEP,
        "ranges_m": ranges,
        "range_min_m": 0.1,
        "range_max_m": 10.0,
    }
    return LaserScan(**{**fields, **changes})


@pytest.mark.parametrize(
    ("ranges", "low", "high", "measured", "free"),
    [
        # As REP-117 says: free as far as the range, to the limit without a return, else unknown.
        (
            [np.nan, np.inf, -np.inf, 0.05, 0.1, 10.0, 10.01, 3.0], 0.1, 10.0,
            [0, 0, 0, 0, 1, 1, 0, 1], [0.0, 10.0, 0.0, 0.0, 0.1, 10.0, 0.0, 3.0],
        ),
        # Several rays of range_max met nothing.
        ([4.0, 4.0, 3.0, 4.0], 0.1, 4.0, [0, 0, 1, 0], [4.0, 4.0, 3.0, 4.0]),
        # 0 is no measurement, whatever range_min is.
        ([0.0, 0.05, 2.0, 0.0], 0.0, 4.0, [0, 1, 1, 0], [0.0, 0.05, 2.0, 0.0]),
    ],
)  # fmt: skip
def test_special_ranges_have_their_meaning(ranges, low, high, measured, free) -> None:
    scan = scan_of(ranges, range_min_m=low, range_max_m=high)
    assert scan.measured.tolist() == [bool(each) for each in measured]
    assert scan.free_m.tolist() == free


def test_a_mounted_scanner_turns_and_lifts_its_points() -> None:
    scanner = Scanner.mounted(0.3, -0.2, 0.25, yaw_rad=math.pi / 2)
    points = scan_points(scan_of([2.0], angle_min_rad=0.0), scanner, HOME)
    np.testing.assert_allclose(points.points_base_m, [[0.3, 1.8, 0.25]], atol=1e-12)
    np.testing.assert_allclose(points.origins_odom_m, [[0.3, -0.2, 0.25]], atol=1e-12)


def test_upside_down_the_rays_turn_clockwise() -> None:
    scan = scan_of([1.0], angle_min_rad=math.pi / 2)
    for upside_down, y in ((False, 1.0), (True, -1.0)):
        scanner = Scanner.mounted(0.0, 0.0, 0.2, upside_down=upside_down)
        points = scan_points(scan, scanner, HOME)
        np.testing.assert_allclose(points.points_base_m, [[0.0, y, 0.2]], atol=1e-12)
        assert np.linalg.det(scanner.T_base_scanner[:3, :3]) == pytest.approx(1.0)


def test_rays_outside_the_view_and_on_the_body_are_no_points() -> None:
    box = np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)])
    scanner = Scanner.mounted(0.0, 0.0, 0.2, field_of_view_rad=(-1.0, 1.0), body_base_m=box)
    scan = scan_of([0.2, 0.34, 0.36, 5.0, 5.0], angle_min_rad=0.0, angle_increment_rad=0.3)
    points = scan_points(scan, scanner, HOME)
    # 0.36 m at 0.6 rad is 0.30 m ahead and so within 5 cm of the outline.
    assert points.usable.tolist() == [False, False, False, True, False]
    assert np.isnan(points.points_odom_m[0]).all()
    # What the body returned is still free space; what is out of view is unknown.
    assert np.isfinite(points.ends_odom_m).all(axis=1).tolist() == [True] * 4 + [False]


def test_a_concave_body_does_not_swallow_its_notch() -> None:
    shape = np.array([(-1, -1), (1, -1), (1, 1), (0.2, 1), (0.2, 0), (-0.2, 0), (-0.2, 1), (-1, 1)])
    scanner = Scanner.mounted(0.0, 0.0, 0.2, body_base_m=shape)
    inside = scanner.is_body(np.array([[0.0, 0.5], [0.5, 0.5], [0.0, -0.5], [0.0, 1.5]]))
    assert inside.tolist() == [False, True, True, False]


def test_a_wall_stays_straight_while_the_robot_drives_and_turns() -> None:
    """A wall at x = 4 m, seen from a moving robot: exact after correction, bent without it."""
    speed, yaw_rate, increment = 1.5, 1.2, 0.05 / 720
    scanner = Scanner.mounted(0.4, 0.1, 0.2)
    motion = RobotMotion(0.0, pose(0.3, -0.2, 0.1), np.array([speed, 0.0]), yaw_rate)
    angles = -0.8 + STEP * np.arange(180)
    ranges = []
    for k, angle in enumerate(angles):
        t = increment * k
        turned = 0.1 + yaw_rate * t
        # The closed form of a circular arc, independent of poses_base().
        x = 0.3 + speed / yaw_rate * (math.sin(turned) - math.sin(0.1))
        x += 0.4 * math.cos(turned) - 0.1 * math.sin(turned)
        ranges.append((4.0 - x) / math.cos(turned + angle))
    scan = scan_of(ranges, angle_min_rad=-0.8, time_increment_s=increment)
    corrected = scan_points(scan, scanner, motion).points_odom_m
    np.testing.assert_allclose(corrected[:, 0], 4.0, atol=1e-9)
    frozen = scan_points(scan, scanner, RobotMotion(0.0, motion.T_odom_base)).points_odom_m
    assert np.ptp(frozen[:, 0]) > 0.02


@given(ANGLES, ANGLES, st.floats(-2.9, 2.9), ANGLES, ANGLES, st.floats(-3.0, 3.0))
def test_motion_between_two_poses_meets_both(x, y, yaw, x0, y0, yaw0) -> None:
    start = pose(x0, y0, yaw0)
    end = start @ pose(x, y, yaw)
    motion = RobotMotion.between(2.0, start, 2.5, end)
    turned, moved = motion.poses_base(np.array([2.0, 2.5]))
    np.testing.assert_allclose(turned, [0.0, yaw], atol=1e-9)
    np.testing.assert_allclose(moved, [[0.0, 0.0], [x, y]], atol=1e-9)


@given(ANGLES, ANGLES, ANGLES, st.floats(-1.0, 1.0), st.floats(-1.5, 1.5))
def test_moving_the_world_moves_the_points(x, y, yaw, speed, yaw_rate) -> None:
    ranges = np.linspace(1.0, 5.0, 90)
    scan = scan_of(ranges, time_increment_s=0.0005)
    scanner = Scanner.mounted(0.2, 0.1, 0.3, yaw_rad=0.7, upside_down=True)
    velocity = np.array([speed, 0.0])
    home = scan_points(scan, scanner, RobotMotion(0.01, np.eye(4), velocity, yaw_rate))
    moved = scan_points(scan, scanner, RobotMotion(0.01, pose(x, y, yaw), velocity, yaw_rate))
    R, t = pose(x, y, yaw)[:3, :3], pose(x, y, yaw)[:3, 3]
    np.testing.assert_allclose(moved.points_odom_m, home.points_odom_m @ R.T + t, atol=1e-9)
    np.testing.assert_allclose(moved.points_base_m, home.points_base_m, atol=1e-12)


# --- rays without a return ------------------------------------------------------------------------


RANGE_MAX_M = 4.0


@functools.cache
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


def test_a_wall_at_range_max_is_still_a_wall() -> None:
    """Noise makes its ranges differ, also where a driver rounds them to millimetres."""
    rng = np.random.default_rng(0)
    ranges = RANGE_MAX_M - 0.02 + 0.01 * rng.standard_normal(300)
    within = ranges <= RANGE_MAX_M
    assert (scan_of(ranges, range_max_m=RANGE_MAX_M).measured == within).all()
    rounded = scan_of(np.round(ranges, 3), range_max_m=RANGE_MAX_M).measured
    assert rounded.sum() > 0.9 * within.sum()
