"""Scans and maps of the bridge: poses, the robot's motion, and what is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from bridge_scenes import (
    FRONT,
    PERSON,
    SCANNER_MOUNT,
    START_S,
    Listener,
    Robot,
    odometry,
    scanning,
    tf,
)
from scan_scenes import planar, ranges_of, scan_message
from scipy.spatial.transform import Rotation

from nav_adapter.ros2 import ScannerInput, ScannerMount
from nav_adapter.ros2.messages.geometry_msgs import Point, Pose, Quaternion
from nav_adapter.ros2.messages.nav_msgs import MapMetaData, OccupancyGrid
from nav_adapter.ros2.messages.std_msgs import Header
from perception.laser import MapCells

PERIOD_S = Robot.period_s


@pytest.mark.parametrize("upside_down", [False, True], ids=["upright", "upside down"])
def test_the_place_of_a_scanner_comes_from_tf(upside_down: bool) -> None:
    mount = ScannerMount(position_base_m=[0.2, -0.1, 0.2], yaw_deg=30.0, upside_down=upside_down)
    T = mount.T_base_scanner()
    nav = Listener(scanners=[ScannerInput("scan")], with_camera=False)
    nav.bridge.on_odometry(odometry(START_S, x=1.0, yaw=0.5, speed=0.0))
    T_odom_scanner = planar(1.0, 0.0, 0.5) @ T
    place = (3.5, 1.5)
    assert not nav.bridge.on_scan(0, scan_message(START_S, [place], T_odom_scanner), START_S)
    assert "no transform between 'scanner' and 'base_link'" in nav.warnings[-1]
    nav.bridge.on_transforms(tf("base_link", "scanner", T), static=True)
    for tick in range(1, 20):
        now = START_S + PERIOD_S * tick
        nav.bridge.on_odometry(odometry(now, x=1.0, yaw=0.5, speed=0.0), now)
        assert nav.bridge.on_scan(0, scan_message(now, [place], T_odom_scanner), now)
    (track,) = nav.bridge.tracks
    assert np.linalg.norm(track.position_odom_m - place) < 0.1


NOW = START_S + 1.0
GOOD = scan_message(NOW)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (replace(GOOD, angle_increment=math.nan), "angle_increment_rad"),
        (replace(GOOD, ranges=()), "at least one range"),
        (replace(GOOD, range_max=0.0), "range_max_m must exceed range_min_m"),
        (scan_message(NOW + 3600.0), "3600.000 s ahead of this computer's clock"),
        (scan_message(NOW - 0.1), "0.060 s before that of the last one"),
        (scan_message(NOW - PERIOD_S), "0.000 s before that of the last one"),
        (scan_message(NOW - 900.0), "before that of the last one"),
        (
            replace(GOOD, time_increment=1e-3),
            "time_increment × rays is 0.540 s, but scans come every 0.040 s",
        ),
        (scan_message(NOW, low_rad=math.radians(140.0), rays=9), "must hold rays"),
    ],
)
def test_a_scan_that_cannot_be_used_is_counted_and_costs_nothing_else(message, text) -> None:
    mount = SCANNER_MOUNT.model_copy(update={"field_of_view_deg": [-135.5, 135.5]})
    nav = Listener(scanners=[replace(FRONT, mount=mount)], with_camera=False)
    for tick in range(25):
        now = START_S + PERIOD_S * tick
        nav.bridge.on_odometry(odometry(now, speed=0.0), now)
        assert nav.bridge.on_scan(0, scan_message(now, [PERSON]), now)
    before = nav.bridge.tracks
    nav.bridge.on_odometry(odometry(NOW, speed=0.0), NOW)
    for _ in range(5):
        assert not nav.bridge.on_scan(0, message, NOW)
    assert nav.bridge.tracks is before
    assert nav.bridge.counts["scans_refused"] == 5
    (warning,) = nav.warnings
    assert warning.startswith("scan_front: scan refused and counted: ")
    assert text in warning
    assert nav.bridge.on_scan(0, scan_message(NOW, [PERSON]), NOW)
    assert [each.id for each in nav.bridge.tracks] == [each.id for each in before]


def test_a_scan_without_a_pose_for_its_time_is_refused() -> None:
    nav = Listener(scanners=[FRONT], with_camera=False)
    assert not nav.bridge.on_scan(0, scan_message(START_S), START_S)
    assert "no odometry yet" in nav.warnings[-1]
    nav.bridge.on_odometry(odometry(START_S))
    assert not nav.bridge.on_scan(0, scan_message(START_S + 0.2), START_S + 20.0)
    assert nav.bridge.counts["scans_refused"] == 2
    # The reason is reported again after a while only.
    assert len(nav.warnings) == 2
    assert "known until" in nav.warnings[-1]


def test_a_scanner_that_is_not_level_is_refused() -> None:
    nav = Listener(scanners=[ScannerInput("scan")], with_camera=False)
    nav.bridge.on_odometry(odometry(START_S))
    T = planar(0.3, 0.0, 0.0, 0.2)
    T[:3, :3] = Rotation.from_euler("y", 20.0, degrees=True).as_matrix()
    nav.bridge.on_transforms(tf("base_link", "scanner", T), static=True)
    assert not nav.bridge.on_scan(0, scan_message(START_S), START_S)
    assert "level within 10 degrees, got a tilt of 20.0" in nav.warnings[-1]


def test_what_the_map_holds_is_nobody_until_the_map_moves_in_odom() -> None:
    """The map is turned and shifted in odom by localisation, which stamps it ahead."""
    T_odom_map = planar(1.0, -2.0, 0.7)
    in_map = np.linalg.inv(T_odom_map) @ [*PERSON, 0.0, 1.0]
    data = np.zeros((200, 200), np.int8)
    column, row = np.floor((in_map[:2] + 10.0) / 0.1).astype(int)
    data[row - 3 : row + 4, column - 3 : column + 4] = 100
    corner = Pose(Point(-10.0, -10.0, 0.0), Quaternion(w=1.0))
    info = MapMetaData(resolution=0.1, width=200, height=200, origin=corner)
    given = OccupancyGrid(Header(frame_id="map"), info, data.tobytes())

    def localise(T: np.ndarray, now_s: float) -> None:
        nav.bridge.on_transforms(tf("map", "odom", np.linalg.inv(T), now_s + 1.0), now_s)

    nav = scanning(people=[PERSON])
    nav.bridge.on_map(given)
    localise(T_odom_map, START_S)
    nav.drive(START_S, 2.0)
    assert nav.bridge.tracks == ()
    localise(planar(1.0, -3.0, 0.7), START_S + 2.0)
    nav.drive(START_S + 2.0, 2.0)
    (track,) = nav.bridge.tracks
    assert np.linalg.norm(track.position_odom_m - PERSON) < 0.1
    nav.bridge.on_map(replace(given, data=b""))
    assert nav.warnings[-1].startswith("map: a map must have width")


def test_scans_that_contradict_the_map_are_told_once_and_when_it_is_over() -> None:
    """The person is kept: the map of a robot that is elsewhere has a wall where they stand."""
    nav = scanning(people=[PERSON])
    angles = np.linspace(-np.pi, np.pi, 20_000)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    walls = ranges_of([], np.zeros((20_000, 2)), directions)[:, None] * directions
    pillar = np.array([PERSON[0], PERSON[1] - 2.0]) + 0.3 * directions
    nav.bridge.on_map(MapCells(np.concatenate((walls, pillar)), 0.1))
    for start_s, shift_m in ((0.0, 2.0), (1.0, 2.0), (2.0, 0.0), (4.5, 0.0)):
        nav.bridge.on_transforms(tf("map", "odom", planar(0.0, -shift_m, 0.0), START_S + start_s))
        nav.drive(START_S + start_s, 1.0 if shift_m else 2.5)
        (track,) = nav.bridge.tracks
        assert np.linalg.norm(track.position_odom_m - PERSON) < 0.1
    lost, over = nav.warnings
    assert lost.startswith("the scans contradict the map, so the robot is elsewhere")
    assert over == "the map is used"


def test_a_map_whose_place_is_unknown_is_not_used() -> None:
    nav = scanning(people=[PERSON])
    info = MapMetaData(resolution=0.1, width=1, height=1)
    nav.bridge.on_map(OccupancyGrid(Header(frame_id="map"), info, b"\x64"))
    nav.drive(START_S, 1.0)
    assert len(nav.bridge.tracks) == 1
    assert len(nav.warnings) == 1
    assert "the map is not used: no transform between 'map' and 'odom'" in nav.warnings[0]
    # Images in between do not repeat it; a place in tf does.
    nav.bridge.refuse("something else")
    nav.drive(START_S + 1.0, 0.2)
    assert len(nav.warnings) == 2
    nav.bridge.on_transforms(tf("map", "odom", np.eye(4)))
    nav.drive(START_S + 1.2, 0.2)
    assert nav.warnings[2:] == ["the map is used"]


def test_legs_of_a_cart_that_ride_along_are_nobody_and_the_footprint_is_named() -> None:
    """Beside somebody who stands, and counts as before."""
    cart = [(-0.55, 0.0), (1.2, 0.0)]
    nav = scanning()
    for robot in (nav, without := scanning()):
        for tick in range(60):
            now = START_S + PERIOD_S * tick
            speed = min(max(tick - 10, 0) * PERIOD_S, 0.6)
            x = 0.5 * max(now - START_S - 0.5, 0.0) ** 2 if speed < 0.6 else None
            if x is None:
                x = 0.18 + 0.6 * (now - START_S - 1.1)
            robot.bridge.on_odometry(odometry(now, x=x, speed=speed), now)
            people = [PERSON, *((x + dx, dy) for dx, dy in cart if robot is nav)]
            T = planar(x + 0.3)
            robot.bridge.on_scan(0, scan_message(now, people, T), now)
            robot.bridge.tick(now)
    (track,) = [each for each in nav.bridge.tracks if each.time_since_seen_s < 0.2]
    (alone,) = without.bridge.tracks
    assert np.linalg.norm(track.position_odom_m - alone.position_odom_m) < 0.05
    assert without.warnings == []
    (said,) = nav.warnings
    assert "keeps its place there while the robot moves" in said
    assert said.endswith("give footprint_m with it")
