"""Odometry of other frames of the robot, and odometry that contradicts tf or itself."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from test_ros2_bridge import INFO, START_S, Listener, image

from nav_adapter.ros2 import Frames, odometry_problems
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import PersonObservation

PERIOD_S = 0.05
HERE = np.eye(4)


def placed(x: float, y: float = 0.0, yaw: float = 0.0, z: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("z", yaw).as_matrix()
    T[:3, 3] = x, y, z
    return T


def tf(parent: str, child: str, T: np.ndarray, stamp_s: float = START_S) -> TFMessage:
    turn = Quaternion(*Rotation.from_matrix(T[:3, :3]).as_quat())
    move = Transform(Vector3(*T[:3, 3]), turn)
    return TFMessage((TransformStamped(Header(to_time(stamp_s), parent), child, move),))


def odometry(
    stamp_s: float,
    T: np.ndarray,
    linear=(0.0, 0.0, 0.0),
    angular=(0.0, 0.0, 0.0),
    child: str = "base_link",
) -> Odometry:
    turn = Quaternion(*Rotation.from_matrix(T[:3, :3]).as_quat())
    return Odometry(
        Header(to_time(stamp_s), "odom"),
        child,
        PoseWithCovariance(Pose(Point(*T[:3, 3]), turn)),
        TwistWithCovariance(Twist(Vector3(*linear), Vector3(*angular))),
    )


class OneAhead:
    """Perception of an unaware person who stands before the camera of a standing robot."""

    def __init__(self, camera, ahead_m: float = 1.8) -> None:
        self.ahead_m = ahead_m

    def process(self, image_rgb, stamp_s, *, floor=None):
        return (
            PersonObservation(
                stamp_s=stamp_s,
                position_camera_m=np.array([0.0, 0.2, self.ahead_m]),
                position_covariance_m2=np.diag([1e-4] * 3),
                gaze_camera=None,
                awareness=0.0,
                awareness_std=0.03,
                score=0.9,
            ),
        )


class Robot(Listener):
    """A bridge that gets odometry, tf and images."""

    def __init__(self, **settings) -> None:
        super().__init__(**{"make_pipeline": OneAhead, **settings})
        self.bridge.on_camera_info(INFO)

    def step(self, now_s: float, message: Odometry, *transforms: TFMessage):
        for each in transforms:
            self.bridge.on_transforms(each, now_s)
        self.bridge.on_odometry(message, now_s)
        self.bridge.on_image(image(now_s), now_s)
        return self.bridge.tick(now_s)

    def drive(self, seconds: float, message_at, transforms_at=lambda t: (), start_s=START_S):
        """Return the constraints of every tick."""
        times = [start_s + PERIOD_S * tick for tick in range(round(seconds / PERIOD_S))]
        return [self.step(now, message_at(now), *transforms_at(now)) for now in times]


def standing_at(T: np.ndarray, child: str = "base_link", linear=(0.3, 0.0, 0.0)):
    return lambda now: odometry(now, T, linear, child=child)


def on_base(T_base_child: np.ndarray, child: str, linear=(0.3, 0.0, 0.0), angular=(0.0, 0.0, 0.0)):
    """Return the odometry of a frame on a robot whose base is at the origin of odom."""
    R, arm = T_base_child[:3, :3], T_base_child[:3, 3]
    moved = R.T @ (np.array(linear) + np.cross(angular, arm))
    return lambda now: odometry(now, T_base_child, moved, R.T @ np.array(angular), child)


@lru_cache
def reference_limit() -> float:
    (*_, last) = Robot().drive(2.0, standing_at(HERE))
    assert last.limited_by == "track 1: reach"
    return last.speed_limit_mps


# Optical: x to the right of the robot, y down, z ahead.
OPTICAL = placed(0.3, -0.1, z=0.9)
OPTICAL[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]


@pytest.mark.parametrize(
    ("child", "T_base_child"),
    [
        ("rear_axle", placed(-0.8)),
        ("front_axle", placed(0.8)),
        ("base_footprint", HERE),
        ("camera_behind", placed(-0.3, yaw=math.pi)),
        ("camera_aside", placed(0.1, 0.2, yaw=math.pi / 2.0)),
        ("tracking_camera_optical", OPTICAL),
    ],
)
@pytest.mark.parametrize("upward", [False, True], ids=["above", "below"])
def test_odometry_of_another_frame_is_that_of_the_base(child, T_base_child, upward) -> None:
    robot = Robot()
    if upward:
        static = tf(child, "base_link", np.linalg.inv(T_base_child))
    else:
        static = tf("base_link", child, T_base_child)
    robot.bridge.on_transforms(static, static=True)
    (*_, last) = robot.drive(2.0, on_base(T_base_child, child))
    assert last.speed_limit_mps == pytest.approx(reference_limit(), abs=0.01)
    state = robot.bridge.robot_state
    assert state.position_odom_m == pytest.approx((0.0, 0.0), abs=1e-9)
    assert state.heading_odom_rad == pytest.approx(0.0, abs=1e-9)
    assert state.velocity_base_mps == pytest.approx((0.3, 0.0), abs=1e-9)
    assert robot.warnings == []


small = st.floats(-2.0, 2.0)


@settings(max_examples=30)
@given(small, small, st.floats(-3.0, 3.0), small, small, st.floats(-1.5, 1.5))
def test_a_twist_is_moved_by_the_lever_arm(x, y, yaw, forward, left, yaw_rate) -> None:
    """The base origin moves as the point of the child's rigid body that it is."""
    T_base_child = placed(x, y, yaw)
    robot = Robot()
    robot.bridge.on_transforms(tf("base_link", "wheel", T_base_child), static=True)
    message = on_base(T_base_child, "wheel", (forward, left, 0.0), (0.0, 0.0, yaw_rate))
    robot.bridge.on_odometry(message(START_S), START_S)
    state = robot.bridge.robot_state
    assert state.velocity_base_mps == pytest.approx((forward, left), abs=1e-9)
    assert state.yaw_rate_radps == pytest.approx(yaw_rate, abs=1e-9)


@pytest.mark.parametrize("transforms", [(), ("odom",), ("map",)], ids=["none", "odom", "map"])
def test_a_child_frame_that_tf_does_not_know_on_the_robot_stops_it(transforms) -> None:
    """A frame known by way of odom or a map is somebody else's odometry, and no place on it."""
    robot = Robot()
    for parent in transforms:
        if parent == "map":
            robot.bridge.on_transforms(tf("map", "odom", HERE), START_S)
        robot.bridge.on_transforms(tf("odom", "base_link", HERE), START_S)
    constraints = robot.drive(
        1.0,
        standing_at(placed(-1.0), "base_footprint"),
        lambda now: [tf("odom", "base_link", HERE, now)] if transforms else [],
    )
    assert {each.speed_limit_mps for each in constraints} == {0.0}
    assert robot.standing()
    reason = constraints[-1].limited_by
    for part in ("'base_footprint'", "'base_link'", "static transform", "--base-frame"):
        assert part in reason
    assert len([text for text in robot.warnings if "base_footprint" in text]) == 1


def test_the_base_frame_can_be_the_odometrys_child() -> None:
    robot = Robot(frames=Frames(base="base_footprint"))
    (*_, last) = robot.drive(2.0, standing_at(HERE, "base_footprint"))
    assert last.speed_limit_mps == pytest.approx(reference_limit())


def test_odometry_waits_for_the_static_transform() -> None:
    robot = Robot()
    assert robot.drive(1.0, standing_at(placed(-0.8), "rear_axle"))[-1].speed_limit_mps == 0.0
    robot.bridge.on_transforms(tf("rear_axle", "base_link", placed(0.8)), static=True)
    (*_, last) = robot.drive(2.0, standing_at(placed(-0.8), "rear_axle"), start_s=START_S + 1.0)
    assert last.speed_limit_mps == pytest.approx(reference_limit())


@pytest.mark.parametrize(
    ("T_odometry", "T_tf", "text", "lag_s", "chain"),
    [
        (placed(-1.0), HERE, "1.00 m and 0° apart", 0.0, "base_link"),
        (placed(0.0, 0.6), HERE, "0.60 m and 0° apart", -0.03, "base_link"),
        (placed(0.0, yaw=math.radians(60)), HERE, "0.00 m and 60° apart", 0.03, "base_link"),
        (placed(3.0, 1.0, 3.1), placed(3.0, 1.0, -2.6), "apart", 0.03, "base_footprint"),
    ],
)
def test_odometry_that_contradicts_tf_stops_the_robot(T_odometry, T_tf, text, lag_s, chain) -> None:
    robot = Robot()
    if chain != "base_link":
        robot.bridge.on_transforms(tf(chain, "base_link", HERE), static=True)
    constraints = robot.drive(
        1.0,
        lambda now: odometry(now - max(lag_s, 0.0), T_odometry, child=chain),
        lambda now: [tf("odom", chain, T_tf, now + min(lag_s, 0.0))],
    )
    assert {each.speed_limit_mps for each in constraints[3:]} == {0.0}
    assert text in constraints[-1].limited_by
    assert "odometry and tf contradict each other" in constraints[-1].limited_by
    assert len(robot.warnings) == 1


def driven(now_s: float, speed_mps: float, yaw_rate_radps: float, heading_rad: float = 0.0):
    """Return the pose of a robot that drives a circle from the origin."""
    t = now_s - START_S
    turned = yaw_rate_radps * t
    half = 0.5 * turned
    way_m = speed_mps * t * float(np.sinc(half / np.pi))
    towards = heading_rad + half
    return placed(way_m * math.cos(towards), way_m * math.sin(towards), heading_rad + turned)


@pytest.mark.parametrize(
    ("yaw_rate", "late_s", "every"), [(0.0, 0.0, 1), (1.0, 0.04, 3), (1.0, 0.0, 1)]
)
def test_one_source_in_odometry_and_tf_agrees_at_any_rates(yaw_rate, late_s, every) -> None:
    """Neither rates, nor delays, nor noise of a centimetre, are a contradiction."""
    robot = Robot()
    random = np.random.default_rng(4)

    def message(now: float) -> Odometry:
        noise = placed(*random.normal(0.0, 0.01, 2), random.normal(0.0, 0.01))
        T = driven(now, 1.4, yaw_rate) @ noise
        return odometry(now, T, (1.4, 0.0, 0.0), (0.0, 0.0, yaw_rate))

    def transforms(now: float):
        if round((now - START_S) / PERIOD_S) % every:
            return []
        return [tf("odom", "base_link", driven(now - late_s, 1.4, yaw_rate), now - late_s)]

    robot.drive(4.0, message, transforms)
    assert robot.warnings == []


def test_a_contradiction_that_ends_is_forgotten_and_the_limit_rises_slowly() -> None:
    robot = Robot()
    apart = lambda now: [tf("odom", "base_link", HERE, now)]  # noqa: E731
    robot.drive(2.0, standing_at(HERE), apart)
    assert not robot.standing()
    robot.drive(1.0, standing_at(placed(-1.0)), apart, START_S + 2.0)
    assert robot.standing()
    stand = standing_at(HERE, linear=(0.0, 0.0, 0.0))
    constraints = robot.drive(6.0, stand, apart, START_S + 3.0)
    limits = [each.speed_limit_mps for each in constraints]
    assert limits[-1] == pytest.approx(reference_limit(), abs=0.03)
    # From the speed of the robot, by its acceleration over at most the time that counts as fresh.
    assert max(np.diff(limits)) <= 0.25 + 1e-9


def test_the_function_for_recordings_says_the_same_as_the_bridge() -> None:
    times = [START_S + PERIOD_S * tick for tick in range(40)]
    drifted = [odometry(now, placed(-1.0)) for now in times]
    poses = [tf("odom", "base_link", HERE, now) for now in times]
    (problem,) = odometry_problems(drifted, poses)
    assert "odometry and tf contradict each other" in problem
    assert odometry_problems([odometry(now, HERE) for now in times], poses) == ()
    behind = [odometry(now, placed(-0.8), child="rear_axle") for now in times]
    (problem,) = odometry_problems(behind)
    assert "'rear_axle'" in problem
    mounted = [tf("base_link", "rear_axle", placed(-0.8))]
    assert odometry_problems(behind, poses, mounted) == ()
    in_map = [replace(each, header=Header(each.header.stamp, "map")) for each in drifted]
    (problem,) = odometry_problems(in_map, poses)
    assert "must be in frame 'odom'" in problem


def test_a_frame_that_moves_on_the_robot_is_followed_although_its_tf_is_slow() -> None:
    """A message whose time tf does not reach yet is left out, and does not stop the robot."""
    robot = Robot()

    def lifted(now: float) -> list[TFMessage]:
        tick = round((now - START_S) / PERIOD_S)
        return [] if tick % 5 else [tf("base_link", "lift", placed(0.1, z=0.1), now)]

    constraints = robot.drive(3.0, on_base(placed(0.1, z=0.1), "lift"), lifted)
    assert 0.5 * reference_limit() < constraints[-1].speed_limit_mps <= reference_limit()
    assert {each.stale for each in constraints[5:]} == {False}
