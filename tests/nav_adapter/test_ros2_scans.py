"""LaserScan and OccupancyGrid messages as drivers send them: what they become, what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bridge_scenes import FRONT, START_S, Listener, odometry
from hypothesis import given
from hypothesis import strategies as st
from scan_scenes import RAYS, planar, scan_message

from nav_adapter import NavError
from nav_adapter.ros2 import ScanMessages, decode, encode, laser_scan_of, map_cells_of
from nav_adapter.ros2.conversions import from_ros, header, to_ros, to_time, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import Point, Pose
from nav_adapter.ros2.messages.nav_msgs import MapMetaData, OccupancyGrid
from nav_adapter.ros2.messages.sensor_msgs import LaserScan
from nav_adapter.ros2.messages.std_msgs import Header

SCAN = scan_message(12.5, [(2.0, 0.0)], time_increment_s=5e-5)
WALLS = (np.arange(12).reshape(3, 4) % 5 == 0).astype(np.int8) * 100


def grid(data: np.ndarray, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> OccupancyGrid:
    height, width = data.shape
    pose = Pose(Point(x, y, 0.0), yaw_quaternion(yaw))
    info = MapMetaData(resolution=0.1, width=width, height=height, origin=pose)
    return OccupancyGrid(Header(frame_id="map"), info, data.astype(np.int8).tobytes())


def test_a_scan_keeps_its_values_through_cdr_to_single_precision() -> None:
    scan = laser_scan_of(decode(LaserScan, encode(SCAN)))
    assert len(scan) == RAYS
    assert scan.stamp_s == pytest.approx(12.5)
    assert scan.end_s == pytest.approx(12.5 + 5e-5 * (RAYS - 1), abs=1e-6)
    np.testing.assert_allclose(scan.ranges_m, SCAN.ranges, rtol=1e-6)
    np.testing.assert_allclose(scan.angles_rad[[0, -1]], np.radians([-135.0, 135.0]), atol=1e-4)


def test_ros_ranges_keep_their_meaning() -> None:
    ranges = (math.inf, -math.inf, math.nan, 0.01, 30.0, 2.0)
    message = replace(SCAN, ranges=ranges, angle_max=SCAN.angle_min + 5 * SCAN.angle_increment)
    scan = laser_scan_of(decode(LaserScan, encode(message)))
    assert scan.measured.tolist() == [False] * 5 + [True]


def test_a_scan_of_rclpy_is_read() -> None:
    theirs = to_ros(SCAN, lambda kind: SimpleNamespace)
    theirs.ranges = np.array(theirs.ranges, np.float32)
    assert laser_scan_of(from_ros(LaserScan, theirs)).ranges_m == pytest.approx(SCAN.ranges)


def scaled(factor: float, where=lambda each: True, other: float = math.inf) -> tuple[float, ...]:
    """Return the ranges in another unit; those that are not ``where`` are ``other``."""
    return tuple(factor * each if where(each) else other for each in SCAN.ranges)


CENTIMETRES = tuple(min(100.0 * each, 200.0 + 0.05 * ray) for ray, each in enumerate(SCAN.ranges))
MILLIMETRES = scaled(1000.0)
SOME_MILLIMETRES = scaled(1000.0, lambda each: each < 3.5)
ELSEWHERE = "angle_max must be the angle of the last ray"
SWEEP = "time_increment must be the seconds from ray to ray"
UNIT = "ranges must be in metres"


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"angle_min": -math.pi, "angle_max": math.pi, "angle_increment": 0.0068}, ELSEWHERE),
        ({"angle_increment": -SCAN.angle_increment}, ELSEWHERE),
        ({"ranges": (2.0,) * 600}, ELSEWHERE),
        ({"time_increment": 153333.328}, SWEEP),
        ({"time_increment": 0.005}, SWEEP),
        ({"time_increment": -0.28}, SWEEP),
        ({"ranges": MILLIMETRES}, UNIT + ": no rays measure anything"),
        ({"ranges": MILLIMETRES, "range_max": 20_000.0}, UNIT + ": no rays measure anything"),
        ({"ranges": MILLIMETRES, "range_max": math.inf}, UNIT + ": no rays measure anything"),
        ({"ranges": scaled(100.0), "range_max": 12.0}, UNIT + ": no rays measure anything"),
        ({"ranges": SOME_MILLIMETRES}, UNIT),
        ({"ranges": SOME_MILLIMETRES, "range_max": 20_000.0}, UNIT),
        # Most of a small room is less than 250 "m" away in centimetres.
        (
            {"ranges": CENTIMETRES, "range_min": 2.0, "range_max": math.inf},
            UNIT + ": no of 541 are below 20 m",
        ),
        ({"range_min": 120.0, "range_max": 3500.0}, "range_min must be in metres, got 120 m"),
        ({"ranges": ()}, "at least one range"),
        ({"ranges": (1.0,) * 20_001}, "at most 20000 rays, got 20001"),
        ({"angle_increment": math.nan}, "angle_increment_rad must be"),
        ({"angle_increment": 0.0}, "angle_increment_rad must not be 0"),
        ({"angle_increment": 0.1}, "at most a full turn"),
        ({"angle_min": math.inf}, "angle_min_rad"),
        ({"angle_max": math.nan}, "angle_max"),
        ({"angle_max": 1.5}, r"angle_max must be the angle of the last ray, .*, 2.3562 rad"),
        ({"range_max": 0.05}, "range_max_m must exceed range_min_m"),
        ({"range_min": -1.0}, "range_min_m"),
        ({"range_max": math.nan}, "range_max_m"),
        ({"time_increment": math.nan}, "time_increment"),
    ],
)
def test_a_scan_that_contradicts_itself_is_refused(change, text: str) -> None:
    with pytest.raises(NavError, match=text):
        laser_scan_of(replace(SCAN, **change))


@pytest.mark.parametrize("beside", [-1, 0, 1])
def test_the_last_angle_may_be_that_of_the_ray_beside_it(beside: int) -> None:
    message = replace(SCAN, angle_max=SCAN.angle_max + beside * SCAN.angle_increment)
    assert len(laser_scan_of(message)) == RAYS


@given(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_a_map_holds_its_cells_wherever_it_lies(x, y, map_yaw, yaw) -> None:
    """The corner's pose in the map and the map's pose in odom compose."""
    cells = map_cells_of(grid(WALLS, x, y, map_yaw))
    T = planar(-y, x, yaw)
    row, column = np.nonzero(WALLS)
    in_grid = np.column_stack((0.1 * column + 0.05, 0.1 * row + 0.05, 0.0 * row, 0.0 * row + 1))
    wanted = (T @ planar(x, y, map_yaw) @ in_grid.T).T[:, :2]
    held = cells.near(T, wanted.mean(axis=0), 30.0)
    assert held.holds(wanted).all()
    assert not held.holds(wanted + np.array([0.0, 3.0])).any()
    # Nothing beyond the reach is kept.
    assert not cells.near(T, wanted.mean(axis=0) + 40.0, 30.0).occupied.any()


def test_unknown_and_free_cells_are_not_occupied() -> None:
    data = np.array([[-1, 0, 64, 65, 100, 101]])
    cells = map_cells_of(grid(data))
    np.testing.assert_allclose(cells.cells_m, [[0.35, 0.05], [0.45, 0.05]])


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (OccupancyGrid(), "0 × 0 and 0 cells"),
        (replace(grid(WALLS), data=b"\0"), "4 × 3 and 1 cells"),
        (
            OccupancyGrid(info=MapMetaData(resolution=math.nan, width=1, height=1), data=b"\0"),
            "resolution must be 0.005 to 1 m, got nan",
        ),
    ],
)
def test_a_map_that_contradicts_itself_is_refused(message: OccupancyGrid, text: str) -> None:
    with pytest.raises(NavError, match=text):
        map_cells_of(message)


HEADED = scan_message(12.5, [(2.0, 0.0)])
PLACE = (2.5, 0.4)
PI = math.pi


def sent(low_rad: float, angle_max_rad: float, step_rad: float, rays: int, **changes) -> LaserScan:
    """Return a message as it comes over DDS, in single precision."""
    message = replace(
        HEADED,
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


@pytest.mark.parametrize("extra", [1, 5, 11])
def test_rays_beyond_a_full_turn_keep_the_nearer_range(extra: int) -> None:
    message = sent(0.0, 2.0 * PI, 2.0 * PI / 450, 451 + extra)
    ranges = np.full(451 + extra, 5.0)
    ranges[-1] = 1.0  # seen by the last ray only
    scan = laser_scan_of(replace(message, ranges=tuple(ranges.tolist())))
    assert 450 <= len(scan) <= 451
    (near,) = np.flatnonzero(scan.ranges_m == 1.0)
    assert scan.angles_rad[near] == pytest.approx(2.0 * PI / 450 * extra, abs=1e-3)


def test_no_limit_of_range_costs_nothing() -> None:
    scan = laser_scan_of(replace(HEADED, range_max=math.inf))
    assert scan.range_max_m == 250.0
    assert scan.ranges_m == pytest.approx(HEADED.ranges)


def test_a_scan_whose_array_was_turned_round_is_read_in_the_order_of_time() -> None:
    turned = replace(HEADED, ranges=HEADED.ranges[::-1], time_increment=-1e-4)
    scan = laser_scan_of(turned)
    last = len(HEADED.ranges) - 1
    assert scan.stamps_s[[0, -1]] == pytest.approx([12.5 - 1e-4 * last, 12.5])
    assert scan.ranges_m == pytest.approx(HEADED.ranges)
    assert scan.angles_rad[0] == pytest.approx(HEADED.angle_max)


def test_far_walls_are_read_where_the_limit_vouches_for_the_unit() -> None:
    far = tuple(30.0 + 0.01 * ray for ray in range(541))
    assert laser_scan_of(replace(HEADED, ranges=far, range_max=100.0)).measured.all()
    some = (3.0,) * 60 + far[60:]
    assert laser_scan_of(replace(HEADED, ranges=some, range_max=math.inf)).measured.all()
    code = (3.0,) * 20 + (65.535,) * 521
    assert laser_scan_of(replace(HEADED, ranges=code, range_max=math.inf)).measured.all()


def test_returns_beyond_a_low_range_max_are_no_other_unit() -> None:
    """Whoever comes within it is still to be found."""
    ranges = tuple(each if each < 6.0 else math.inf for each in HEADED.ranges)
    scan = laser_scan_of(replace(HEADED, ranges=ranges, range_max=3.5))
    assert 3 < scan.measured.sum() < 100


def test_a_code_for_no_return_is_no_unit() -> None:
    """One value beyond the limits on most rays, beside some true ranges."""
    ranges = tuple(each if each < 4.0 else 9999.0 for each in HEADED.ranges)
    assert laser_scan_of(replace(HEADED, ranges=ranges)).measured.sum() > 3


def found(stamp_at: str, rate_hz: float, speed_mps: float = 1.0):
    """Return a bridge that has followed somebody for 2 s past whom the robot drives."""
    nav = Listener(scanners=[FRONT], with_camera=False)
    period_s = 1.0 / rate_hz
    rays = len(HEADED.ranges)
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


def sweep_at(stamp_s: float) -> LaserScan:
    """Return a scan of 0.1 s."""
    head, ray_s = header(stamp_s, "scan"), 0.1 / (RAYS - 1)
    return replace(HEADED, header=head, scan_time=0.1, time_increment=ray_s)


@pytest.mark.parametrize("early", [(0,), (1,), (7,), (17, 18, 19)])
def test_scans_that_come_early_while_a_clock_is_set_shift_no_later_one(early) -> None:
    """A scan that came first or second decides until later ones show another clock."""
    said: list[str] = []
    messages = ScanMessages("front", said.append)
    shifted = []
    for sweep in range(40):
        start_s = START_S + 0.1 * sweep
        message = sweep_at(start_s)
        now_s = start_s + 0.105 - (0.07 if sweep in early else 0.0)
        shifted.append(messages.read(message, now_s).stamp_s < start_s - 1e-6)
    assert not any(shifted[max(early) + 10 :])
    assert any(shifted) is (early[0] < 2)
    assert len(said) == (early[0] < 2)


@given(st.lists(st.booleans(), min_size=20, max_size=60))
def test_a_scanner_stamped_at_the_end_stays_so_while_some_scans_come_at_once(late) -> None:
    messages, told = ScanMessages("front", lambda text: None), []
    for sweep, delayed in enumerate([False] * 20 + late):
        end_s = START_S + 0.1 * sweep
        scan = messages.read(sweep_at(end_s), end_s + (0.2 if delayed else 0.01))
        told.append(scan.end_s == pytest.approx(end_s, abs=1e-3))
        last = ([False] * 20 + late)[max(0, sweep - 19) : sweep + 1]
        assert told[-1] is (last.count(False) >= 0.25 * len(last))


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
    nav.bridge.on_odometry(odometry(START_S - 0.1, speed=0.0), START_S - 0.1)
    for tick in range(5):
        now_s = START_S + 0.1 * tick
        nav.bridge.on_odometry(odometry(now_s, speed=0.0), now_s)
        message = replace(scan_message(now_s, [PLACE]), time_increment=-1e-5)
        assert nav.bridge.on_scan(0, message, now_s)
    (warning,) = nav.warnings
    assert "time_increment is negative: the last ray is the oldest" in warning
