"""LaserScan and OccupancyGrid messages: what they become, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from scan_scenes import RAYS, planar, scan_message

from nav_adapter import NavError
from nav_adapter.ros2 import decode, encode, laser_scan_of, map_cells_of
from nav_adapter.ros2.conversions import from_ros, to_ros, yaw_quaternion
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
    assert scan.intensities is None
    np.testing.assert_allclose(scan.ranges_m, SCAN.ranges, rtol=1e-6)
    np.testing.assert_allclose(scan.angles_rad[[0, -1]], np.radians([-135.0, 135.0]), atol=1e-4)


def test_ros_ranges_keep_their_meaning() -> None:
    ranges = (math.inf, -math.inf, math.nan, 0.01, 30.0, 2.0)
    message = replace(SCAN, ranges=ranges, angle_max=SCAN.angle_min + 5 * SCAN.angle_increment)
    scan = laser_scan_of(decode(LaserScan, encode(message)))
    assert scan.measured.tolist() == [False] * 5 + [True]
    assert scan.free_m.tolist() == [20.0, 0.0, 0.0, 0.0, 0.0, 2.0]


def test_a_scan_of_rclpy_is_read() -> None:
    theirs = to_ros(SCAN, lambda kind: SimpleNamespace)
    theirs.ranges = np.array(theirs.ranges, np.float32)
    assert laser_scan_of(from_ros(LaserScan, theirs)).ranges_m == pytest.approx(SCAN.ranges)


@pytest.mark.parametrize(
    ("change", "text"),
    [
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
