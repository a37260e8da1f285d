"""A footprint that changes with the load, from a topic."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from bridge_scenes import FRONT, START_S, Robot, Seeing, attentive, odometry
from hypothesis import example, given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT
from shapely.geometry import MultiPoint

from nav_adapter import NavConstraints
from nav_adapter.ros2.conversions import header, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Point32,
    Polygon,
    PolygonStamped,
    Pose,
    PoseWithCovariance,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry

PLACE_M, HEADING_RAD, SPEED_MPS = 40.0, 0.7, 0.5
metres = st.floats(0.0, 1.5)


def outline(front: float = 0.0, rear: float = 0.0, side: float = 0.0) -> np.ndarray:
    """Return the corners of the robot, longer and wider by so much."""
    return (
        ROBOT.footprint_m
        + np.sign(ROBOT.footprint_m) * [0.0, side]
        + np.where(ROBOT.footprint_m > 0.0, [front, 0.0], [0.0, 0.0])
        - np.where(ROBOT.footprint_m < 0.0, [rear, 0.0], [0.0, 0.0])
    )


class Loaded(Robot):
    """A robot far from odom's origin, and somebody before it."""

    speed_mps = SPEED_MPS

    def __init__(self, awareness: float | None = 0.0) -> None:
        super().__init__(make_pipeline=lambda camera: Seeing(3.5, awareness))

    def odometry(self, now_s: float) -> Odometry:
        way_m = SPEED_MPS * (now_s - START_S)
        place = Point(PLACE_M + way_m * math.cos(HEADING_RAD), way_m * math.sin(HEADING_RAD), 0.0)
        pose = PoseWithCovariance(Pose(place, yaw_quaternion(HEADING_RAD)))
        return replace(odometry(now_s, speed=SPEED_MPS), pose=pose)

    def send(self, corners: np.ndarray, now_s: float, frame: str = "base_link") -> bool:
        if frame == "odom":
            turn = np.array(
                [
                    [math.cos(HEADING_RAD), -math.sin(HEADING_RAD)],
                    [math.sin(HEADING_RAD), math.cos(HEADING_RAD)],
                ]
            )
            place = self.odometry(now_s).pose.pose.position
            corners = corners @ turn.T + [place.x, place.y]
        polygon = Polygon(tuple(Point32(x, y, 0.0) for x, y in corners.tolist()))
        return self.bridge.on_footprint(PolygonStamped(header(now_s, frame), polygon), now_s)

    def with_load(self, corners: np.ndarray, frame: str = "base_link") -> NavConstraints:
        """Return the constraints half a second after a load was taken."""
        self.drive(START_S, 0.4)
        assert self.send(corners, START_S + 0.36, frame)
        return self.drive(START_S + 0.4, 0.5)[-1]


@settings(max_examples=8, deadline=None)
@given(
    less=st.tuples(metres, metres, metres),
    more=st.tuples(metres, metres, metres),
    awareness=st.sampled_from([0.0, 0.95, None]),
)
def test_a_larger_footprint_never_raises_the_limit(less, more, awareness) -> None:
    limits = [
        Loaded(awareness).with_load(outline(*sizes)).speed_limit_mps
        for sizes in ((0.0, 0.0, 0.0), less, tuple(np.add(less, more)))
    ]
    assert limits[2] <= limits[1] + 1e-9 <= limits[0] + 2e-9


@settings(max_examples=6, deadline=None)
@given(longer=metres, wider=metres)
@example(longer=0.0, wider=0.0)
def test_an_outline_in_odom_is_that_of_the_base(longer: float, wider: float) -> None:
    """Nav2 publishes it turned and shifted with the robot's pose."""
    corners = outline(longer, 0.0, wider)
    one, other = (Loaded().with_load(corners, frame) for frame in ("base_link", "odom"))
    assert one.speed_limit_mps == pytest.approx(other.speed_limit_mps, abs=2e-3)
    shapes = [MultiPoint(each.robot.footprint_m).convex_hull for each in (one, other)]
    assert shapes[0].hausdorff_distance(shapes[1]) < 2e-3


def test_people_are_kept_and_a_load_that_is_left_no_longer_counts() -> None:
    nav = Loaded()
    free = nav.drive(START_S, 0.4)[-1]
    identity = nav.bridge.tracks[0].id
    assert nav.send(outline(front=1.0), START_S + 0.36)
    loaded = nav.drive(START_S + 0.4, 0.4)[-1]
    assert loaded.speed_limit_mps < free.speed_limit_mps
    assert nav.send(outline(), START_S + 0.76)
    left = nav.drive(START_S + 0.8, 0.4)[-1]
    assert left.robot is not None
    np.testing.assert_allclose(left.robot.footprint_m.max(axis=0), ROBOT.footprint_m.max(axis=0))
    assert nav.bridge.tracks[0].id == identity


def test_another_profile_keeps_the_load() -> None:
    nav = Loaded()
    before = nav.with_load(outline(front=1.0))
    nav.bridge.use_robot(replace(ROBOT, max_speed_mps=1.0))
    after = nav.drive(START_S + 0.9, 0.04)[-1]
    assert before.robot is not None
    assert after.robot is not None
    assert after.robot.max_speed_mps == 1.0
    np.testing.assert_array_equal(after.robot.footprint_m, before.robot.footprint_m)
    assert nav.send(outline(), START_S + 0.9)
    left = nav.drive(START_S + 0.94, 0.04)[-1]
    assert left.robot is not None
    assert left.robot.footprint_m.max() == ROBOT.footprint_m.max()


def test_a_smaller_outline_does_not_shrink_the_robot() -> None:
    nav = Loaded()
    small = nav.with_load(0.5 * ROBOT.footprint_m)
    same = Loaded().with_load(ROBOT.footprint_m)
    assert small.speed_limit_mps == same.speed_limit_mps
    assert small.robot is not None
    assert small.robot.footprint_m.max() == ROBOT.footprint_m.max()


@pytest.mark.parametrize(
    ("corners", "frame", "late_s", "words"),
    [
        (outline()[:2], "base_link", 0.0, "at least 3 corners"),
        (1000.0 * outline(), "base_link", 0.0, "within 10 m"),
        (np.zeros((0, 2)), "odom", 0.0, "at least 3 corners"),
        (np.full((4, 2), np.nan), "base_link", 0.0, "finite"),
        (np.full((4, 2), np.inf), "base_link", 0.0, "finite"),
        (outline() + np.array([5.0, 0.0]), "base_link", 0.0, "wholly ahead of"),
        (outline(), "nowhere", 0.0, "no transform between 'nowhere'"),
        (outline(), "odom", 4.0, "holds 0.1 s longer"),
    ],
)
def test_a_footprint_that_is_refused_keeps_the_last_and_says_so(corners, frame, late_s, words):
    nav = Loaded()
    before = nav.with_load(outline(front=0.8))
    now_s = START_S + 0.9
    assert not nav.send(corners, now_s + late_s, frame)
    assert not nav.send(corners, now_s + late_s, frame)
    (said,) = [text for text in nav.warnings if "footprint" in text]
    assert words in said
    assert "the last one is kept" in said
    after = nav.drive(now_s, 0.04)[-1]
    assert before.robot is not None
    assert after.robot is before.robot


def test_scans_do_not_take_the_load_for_people() -> None:
    """Posts of a rack on the robot are inside the outline with the load."""
    posts = [(1.0, 0.1), (1.0, -0.1)]
    seen = []
    for front in (0.0, 1.0):
        nav = Robot(FRONT, people=posts, make_pipeline=attentive)
        nav.drive(START_S, 0.4)
        polygon = Polygon(tuple(Point32(x, y, 0.0) for x, y in outline(front).tolist()))
        message = PolygonStamped(header(START_S + 0.4, "base_link"), polygon)
        nav.bridge.on_footprint(message, START_S + 0.4)
        nav.drive(START_S + 0.4, 2.0)
        seen.append(len(nav.bridge.tracks))
    assert seen[1] < seen[0]
