"""Headers of scans as drivers send them: read as costmaps read them, or refused by their cause."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from scan_scenes import planar, scan_message
from test_ros2_bridge import START_S, Listener, odometry
from two_sensor_scenes import FRONT

from nav_adapter import NavError
from nav_adapter.ros2 import decode, encode, laser_scan_of
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.sensor_msgs import LaserScan

SCAN = scan_message(12.5, [(2.0, 0.0)])
PLACE = (2.5, 0.4)
PI = math.pi


def sent(low_rad: float, angle_max_rad: float, step_rad: float, rays: int, **changes) -> LaserScan:
    """Return a message as it comes over DDS, in single precision."""
    message = replace(
        SCAN,
        angle_min=low_rad,
        angle_max=angle_max_rad,
        angle_increment=step_rad,
        ranges=tuple(np.linspace(2.0, 3.0, rays).tolist()),
        **changes,
    )
    return decode(LaserScan, encode(message))


@pytest.mark.parametrize(
    "message",
    [
        pytest.param(sent(-PI, PI, 0.00869043637067, 719), id="YDLIDAR X4"),
        pytest.param(sent(-PI, PI, 0.00872664619237, 710), id="last rays missing"),
        pytest.param(sent(-PI, PI, 2.0 * PI / 720, 702), id="2.5 % missing"),
        pytest.param(sent(-PI, 0.0, 2.0 * PI / 360, 360), id="angle_max not set"),
        pytest.param(sent(0.5, 4.9 - 2.0 * PI, 4.4 / 300, 301), id="angle_max within pi"),
        pytest.param(sent(2.0, 0.5 - 4.0 + 2.0 * PI, -5.5 / 250, 251), id="clockwise, within pi"),
    ],
)
def test_number_and_increment_place_the_rays(message: LaserScan) -> None:
    scan = laser_scan_of(message)
    rays = np.arange(len(message.ranges))
    assert len(scan) == len(rays)
    np.testing.assert_allclose(scan.angles_rad, message.angle_min + message.angle_increment * rays)


@pytest.mark.parametrize(
    "message",
    [
        pytest.param(sent(-PI, PI, 2.0 * PI / 918, 719), id="increment of another number"),
        pytest.param(sent(PI, -PI, 2.0 * PI / 719, 720), id="increment of the wrong sign"),
        pytest.param(sent(-2.0, 2.0, 0.01, 450), id="too many rays"),
    ],
)
def test_rays_that_may_be_elsewhere_are_refused(message: LaserScan) -> None:
    with pytest.raises(NavError, match="angle_max must be the angle of the last ray"):
        laser_scan_of(message)


@pytest.mark.parametrize("extra", [1, 5, 11])
def test_rays_beyond_a_full_turn_keep_the_nearer_range(extra: int) -> None:
    message = sent(0.0, 2.0 * PI, 2.0 * PI / 450, 451 + extra)
    ranges = np.full(451 + extra, 5.0)
    ranges[-1] = 1.0  # seen by the last ray only
    scan = laser_scan_of(replace(message, ranges=tuple(ranges.tolist())))
    assert 450 <= len(scan) <= 451
    (near,) = np.flatnonzero(scan.ranges_m == 1.0)
    assert scan.angles_rad[near] == pytest.approx(2.0 * PI / 450 * extra, abs=1e-3)


def test_no_limit_of_range_and_odd_intensities_cost_nothing() -> None:
    scan = laser_scan_of(replace(SCAN, range_max=math.inf, intensities=(1.0, 2.0)))
    assert scan.range_max_m == 250.0
    assert scan.intensities is None
    assert scan.ranges_m == pytest.approx(SCAN.ranges)


def test_a_scan_whose_array_was_turned_round_is_read_in_the_order_of_time() -> None:
    turned = replace(SCAN, ranges=SCAN.ranges[::-1], time_increment=-1e-4)
    scan = laser_scan_of(turned)
    last = len(SCAN.ranges) - 1
    assert scan.stamps_s[[0, -1]] == pytest.approx([12.5 - 1e-4 * last, 12.5])
    assert scan.ranges_m == pytest.approx(SCAN.ranges)
    assert scan.angles_rad[0] == pytest.approx(SCAN.angle_max)


@pytest.mark.parametrize("increment", [153333.328, 0.28, 0.005, -0.28])
def test_a_sweep_of_seconds_names_its_time_increment(increment: float) -> None:
    with pytest.raises(NavError, match="time_increment must be the seconds from ray to ray"):
        laser_scan_of(replace(SCAN, time_increment=increment))


@pytest.mark.parametrize(
    ("factor", "range_max"),
    [(1000.0, 20.0), (1000.0, 20_000.0), (1000.0, math.inf), (100.0, 12.0)],
    ids=["mm", "mm, limits too", "mm, no limit", "cm"],
)
def test_ranges_in_other_units_are_refused(factor: float, range_max: float) -> None:
    ranges = tuple(factor * each for each in SCAN.ranges)
    with pytest.raises(NavError, match=r"ranges must be in metres: no rays measure anything"):
        laser_scan_of(replace(SCAN, ranges=ranges, range_max=range_max))


@pytest.mark.parametrize("range_max", [20.0, 20_000.0])
def test_some_returns_in_millimetres_among_rays_without_one_are_refused(range_max: float) -> None:
    ranges = tuple(1000.0 * each if each < 3.5 else math.inf for each in SCAN.ranges)
    assert 10 < np.isfinite(ranges).sum() < 0.5 * len(ranges)
    with pytest.raises(NavError, match="ranges must be in metres"):
        laser_scan_of(replace(SCAN, ranges=ranges, range_max=range_max))


@pytest.mark.parametrize("range_max", [1200.0, math.inf])
def test_ranges_in_centimetres_are_no_far_away_walls(range_max: float) -> None:
    """Most of a small room is less than 250 "m" away in centimetres."""
    ranges = tuple(min(100.0 * each, 200.0 + 0.05 * ray) for ray, each in enumerate(SCAN.ranges))
    with pytest.raises(NavError, match="ranges must be in metres: no of 541 are below 20 m"):
        laser_scan_of(replace(SCAN, ranges=ranges, range_min=2.0, range_max=range_max))


def test_far_walls_are_read_where_the_limit_vouches_for_the_unit() -> None:
    far = tuple(30.0 + 0.01 * ray for ray in range(541))
    assert laser_scan_of(replace(SCAN, ranges=far, range_max=100.0)).measured.all()
    some = (3.0,) * 60 + far[60:]
    assert laser_scan_of(replace(SCAN, ranges=some, range_max=math.inf)).measured.all()
    code = (3.0,) * 20 + (65.535,) * 521
    assert laser_scan_of(replace(SCAN, ranges=code, range_max=math.inf)).measured.all()


def test_a_range_min_in_another_unit_is_named() -> None:
    with pytest.raises(NavError, match="range_min must be in metres, got 120 m"):
        laser_scan_of(replace(SCAN, range_min=120.0, range_max=3500.0))


def test_returns_beyond_a_low_range_max_are_no_other_unit() -> None:
    """Whoever comes within it is still to be found."""
    ranges = tuple(each if each < 6.0 else math.inf for each in SCAN.ranges)
    scan = laser_scan_of(replace(SCAN, ranges=ranges, range_max=3.5))
    assert 3 < scan.measured.sum() < 100


def test_a_code_for_no_return_is_no_unit() -> None:
    """One value beyond the limits on most rays, beside some true ranges."""
    ranges = tuple(each if each < 4.0 else 9999.0 for each in SCAN.ranges)
    assert laser_scan_of(replace(SCAN, ranges=ranges)).measured.sum() > 3


def found(stamp_at: str, rate_hz: float, speed_mps: float = 1.0):
    """Return a bridge that has followed somebody for 2 s past whom the robot drives."""
    nav = Listener(scanners=[FRONT], with_camera=False)
    period_s = 1.0 / rate_hz
    rays = len(SCAN.ranges)
    for sweep in range(round(2.0 * rate_hz)):
        start_s = START_S + period_s * sweep
        stamps = start_s + period_s * np.arange(rays) / rays
        x_m = speed_mps * (stamps - START_S) - 2.0
        now_s = start_s + period_s + 0.005
        for tick in range(round(period_s / 0.02) + 1):
            at_s = start_s + 0.02 * tick
            here = odometry(at_s, x=speed_mps * (at_s - START_S) - 2.0, speed=speed_mps)
            nav.bridge.on_odometry(here, now_s)
        message = scan_message(
            start_s,
            [PLACE],
            poses=[planar(x + 0.3, 0.0, 0.0) for x in x_m],
            time_increment_s=period_s / rays,
        )
        stamp_s = start_s if stamp_at == "start" else now_s - 0.005
        header = replace(message.header, stamp=to_time(stamp_s))
        message = replace(message, header=header, scan_time=period_s)
        nav.bridge.on_scan(0, message, now_s)
    return nav


@pytest.mark.parametrize("rate_hz", [5.0, 10.0])
def test_stamps_at_the_end_of_the_sweep_place_people_as_stamps_at_its_start(rate_hz) -> None:
    right, nav = found("start", rate_hz), found("end", rate_hz)
    assert not right.warnings
    (warning,) = nav.warnings
    assert "the stamp is taken for that of the last ray" in warning
    assert "time_increment" in warning
    (track,), (wanted,) = nav.bridge.tracks, right.bridge.tracks
    np.testing.assert_allclose(track.position_odom_m, wanted.position_odom_m, atol=0.02)
    assert np.linalg.norm(track.position_odom_m - PLACE) < 0.1


def test_a_time_increment_that_scan_time_denies_is_named() -> None:
    nav = Listener(scanners=[FRONT], with_camera=False)
    nav.bridge.on_odometry(odometry(START_S, speed=0.0), START_S)
    wrong = replace(scan_message(START_S, [PLACE]), time_increment=1e-3)
    assert not nav.bridge.on_scan(0, wrong, START_S)
    (warning,) = nav.warnings
    assert "time_increment × rays is 0.540 s, but scan_time 0.040 s" in warning


@pytest.mark.parametrize("scan_time", [0.0, 1.0])
def test_sweeps_that_go_on_while_others_begin_are_named(scan_time: float) -> None:
    """Also where scan_time is not set, or is wrong by the same factor."""
    nav = Listener(scanners=[FRONT], with_camera=False)
    used = []
    for tick in range(200):
        now_s = START_S + 0.02 * tick
        nav.bridge.on_odometry(odometry(now_s, speed=0.0), now_s)
        if tick > 75 and tick % 5 == 0:
            sent = scan_message(now_s, [PLACE], time_increment_s=1.0 / 541)
            used.append(nav.bridge.on_scan(0, replace(sent, scan_time=scan_time), now_s))
    assert not any(used[4:])
    assert nav.bridge.tick(now_s).speed_limit_mps == 0.0
    assert any("is 0.998 s, but scans come every 0.100 s" in each for each in nav.warnings)


def test_corrections_are_said_once() -> None:
    nav = Listener(scanners=[FRONT], with_camera=False)
    for tick in range(5):
        now_s = START_S + 0.1 * tick
        nav.bridge.on_odometry(odometry(now_s, speed=0.0), now_s)
        message = replace(scan_message(now_s, [PLACE]), intensities=(1.0,))
        assert nav.bridge.on_scan(0, message, now_s)
    (warning,) = nav.warnings
    assert "541 ranges but 1 intensities, which are not used" in warning
