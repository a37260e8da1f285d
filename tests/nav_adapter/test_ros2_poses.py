"""One rule for a pose in time: images and scans are placed on the robot's own arc."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bridge_scenes import FRONT, INFO, MOUNT, SCANNER_MOUNT, Listener, image, tf
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from nav_scenes import finite
from scan_scenes import planar, scan_message

from nav_adapter import NavError
from nav_adapter.rigid import Motion
from nav_adapter.ros2 import Frames
from nav_adapter.ros2._clock import BridgeClock
from nav_adapter.ros2._poses import PoseSpread, RobotPoses
from nav_adapter.ros2.conversions import header, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from perception import PersonObservation

START_S = 50.0
motions = st.builds(
    Motion,
    *(finite(-20.0, 20.0), finite(-20.0, 20.0), finite(-3.0, 3.0)),
    *(finite(-2.0, 2.0), finite(-1.0, 1.0), finite(-2.0, 2.0)),
)


def message(stamp_s: float, motion: Motion) -> Odometry:
    pose = Pose(Point(motion.x_m, motion.y_m, 0.0), yaw_quaternion(motion.heading_rad))
    twist = Twist(
        Vector3(motion.forward_mps, motion.left_mps, 0.0), Vector3(0.0, 0.0, motion.yaw_rate_radps)
    )
    return Odometry(
        header(stamp_s, "odom"), "base_link", PoseWithCovariance(pose), TwistWithCovariance(twist)
    )


def told(motion: Motion, *after_s: float) -> RobotPoses:
    """Return poses that have heard of a robot on an arc at times after the start."""
    warnings: list[str] = []
    poses = RobotPoses(Frames(), MOUNT, BridgeClock(), warnings.append, with_map=False)
    for each_s in after_s:
        poses.read_odometry(message(START_S + each_s, motion.at(each_s)), None)
    assert warnings == []
    return poses


def pose_of(motion: Motion) -> np.ndarray:
    return planar(motion.x_m, motion.y_m, motion.heading_rad)


def seen(**changes: Any) -> PersonObservation:
    given: dict[str, Any] = {
        "stamp_s": START_S,
        "position_camera_m": np.array([0.5, 0.2, 5.0]),
        "position_covariance_m2": np.diag([0.01, 0.02, 0.09]),
        "gaze_camera": None,
        "awareness": None,
        "awareness_std": None,
        "score": 0.9,
        "box_xyxy_px": None,
    }
    return PersonObservation(**(given | changes))


@settings(max_examples=60)
@given(motions, st.lists(finite(0.0, 0.5), min_size=1, max_size=30), finite(0.0, 0.59))
def test_a_pose_does_not_depend_on_how_the_arc_was_sampled(motion, dense_s, at_s) -> None:
    """Images and scans are where the robot's own motion has them, between messages and after."""
    assume(abs(motion.yaw_rate_radps) > 1e-6 or motion.yaw_rate_radps == 0.0)
    true = pose_of(motion.at(at_s))
    for sampled_s in ((0.0, 0.5), (0.0, *sorted({round(each, 3) for each in dense_s}), 0.5)):
        poses = told(motion, *sampled_s)
        assert np.allclose(poses.T_odom_camera("any", START_S + at_s), true @ MOUNT, atol=1e-6)
        for sweep_s in (0.0, 0.1):
            scan = poses.motion(START_S + at_s - min(sweep_s, at_s), START_S + at_s)
            for ray_s in np.linspace(max(0.0, at_s - sweep_s), at_s, 4):
                on_arc = pose_of(motion.at(float(ray_s)))
                assert np.allclose(scan.pose_at(START_S + float(ray_s)), on_arc, atol=1e-6)


@given(motions, motions, finite(0.0, 0.29), st.booleans())
def test_turned_shifted_or_mirrored_odometry_gives_the_same_poses(motion, frame, at_s, mirrored):
    """The motion of :func:`frame` is only used as a pose: of another odom frame in this one."""
    sign = -1.0 if mirrored else 1.0
    other = motion._replace(
        heading_rad=frame.heading_rad + sign * motion.heading_rad,
        left_mps=sign * motion.left_mps,
        yaw_rate_radps=sign * motion.yaw_rate_radps,
    )
    x_m, y_m = frame.point(motion.x_m, sign * motion.y_m)
    other = other._replace(x_m=x_m, y_m=y_m)
    flip = np.diag([1.0, sign, 1.0, 1.0])
    ours, theirs = (told(each, 0.0, 0.2) for each in (motion, other))
    stamp_s = START_S + at_s
    here = ours.motion(stamp_s, stamp_s).pose_at(stamp_s)
    there = theirs.motion(stamp_s, stamp_s).pose_at(stamp_s)
    assert np.allclose(pose_of(frame) @ flip @ here @ flip, there, atol=1e-6)
    assert theirs.spread(stamp_s) == pytest.approx(ours.spread(stamp_s), abs=1e-9)


@given(motions, finite(0.0, 0.1), finite(0.0, 0.1))
def test_the_error_of_a_pose_grows_from_the_newest_odometry_on(motion, sooner_s, later_s) -> None:
    poses = told(motion, 0.0, 0.2)
    assert poses.spread(START_S + 0.15) == poses.spread(START_S + 0.2) == PoseSpread()
    sooner_s, later_s = sorted((sooner_s, later_s))
    sooner, later = (poses.spread(START_S + 0.2 + each) for each in (sooner_s, later_s))
    assert all(one <= other for one, other in zip(sooner, later, strict=True))
    # A robot that brakes or begins to turn is within three standard deviations.
    assert 3.0 * later.place_m >= 0.5 * 2.0 * later_s**2 - 1e-9
    assert 3.0 * later.heading_rad >= 0.5 * 3.0 * later_s**2 - 1e-9


def test_the_error_of_a_pose_is_in_the_places_of_its_people() -> None:
    """Checked against drawn poses, for a camera that looks down and to the side."""
    spread, rng = PoseSpread(0.03, 0.02), np.random.default_rng(0)
    T = pose_of(Motion(2.0, -1.0, 0.7)) @ MOUNT
    T[:3, :3] = T[:3, :3] @ pose_of(Motion(0.0, 0.0, 0.4))[:3, :3]
    (widened,) = spread.widened([seen()], T)
    added = widened.position_covariance_m2 - seen().position_covariance_m2
    away = T[:3, :3] @ seen().position_camera_m
    drawn = []
    for heading_rad, x_m, y_m in rng.normal(0.0, [0.02, 0.03, 0.03], (20_000, 3)):
        turned = pose_of(Motion(0.0, 0.0, heading_rad))[:3, :3] @ away
        drawn.append(turned - away + (x_m, y_m, 0.0))
    expected = T[:3, :3].T @ np.cov(np.array(drawn).T) @ T[:3, :3]
    assert np.allclose(added, expected, atol=3e-4)
    (same,) = PoseSpread().widened([seen()], T)
    assert np.array_equal(same.position_covariance_m2, seen().position_covariance_m2)


def test_a_pose_too_long_after_the_newest_odometry_is_refused_for_images_and_scans() -> None:
    poses, stamp_s = told(Motion(0.0, 0.0, 0.0, 1.0, 0.0, 1.0), 0.0), START_S + 0.15
    with pytest.raises(NavError, match="known until"):
        poses.T_odom_camera("any", stamp_s)
    with pytest.raises(NavError, match="known until"):
        poses.motion(stamp_s - 0.1, stamp_s)


class Fixed:
    """Perception of one person who stands in odom, by a camera on a robot on an arc."""

    def __init__(self, motion: Motion, person_odom_m: tuple[float, float]) -> None:
        self.motion, self.person = motion, np.array([*person_odom_m, 1.0, 1.0])

    def process(self, image_rgb, stamp_s, floor=None, *, up_camera=None):
        T_odom_camera = pose_of(self.motion.at(stamp_s - START_S)) @ MOUNT
        place = (np.linalg.inv(T_odom_camera) @ self.person)[:3]
        return (seen(stamp_s=stamp_s, position_camera_m=place),)


@pytest.mark.parametrize("sensor", ["camera", "scanner"])
@pytest.mark.parametrize("yaw_rate_radps", [-1.0, 0.0, 1.0])
def test_people_stand_where_they_do_however_seldom_odometry_comes(sensor, yaw_rate_radps) -> None:
    motion = Motion(0.0, 0.0, -0.5 * yaw_rate_radps, 0.3, 0.0, yaw_rate_radps)
    person, found = (4.0, 0.5), []
    for every in (1, 5, 9):  # ticks of 10 ms
        nav = Listener(
            T_base_camera=MOUNT,
            make_pipeline=lambda camera: Fixed(motion, person),
            with_camera=sensor == "camera",
            scanners=[FRONT] if sensor == "scanner" else [],
        )
        nav.bridge.on_camera_info(INFO)
        for tick in range(100):
            now_s, here = START_S + 0.01 * tick, motion.at(0.01 * tick)
            if tick % every == 0:
                nav.bridge.on_odometry(message(now_s, here), now_s)
            if tick % 4 == 3 and sensor == "camera":
                assert nav.bridge.on_image(image(now_s), now_s)
            elif tick % 4 == 3:
                T = pose_of(here) @ SCANNER_MOUNT.T_base_scanner()
                assert nav.bridge.on_scan(0, scan_message(now_s, [person], T), now_s)
        (track,) = nav.bridge.tracks
        found.append(track)
    for track in found:
        assert np.linalg.norm(track.position_odom_m - person) < 0.1
        assert np.linalg.norm(track.position_odom_m - found[0].position_odom_m) < 0.02
    # The less is known about the robot's pose, the less about the people's.
    variances = [float(np.trace(each.covariance_odom[:2, :2])) for each in found]
    assert variances == sorted(variances)


def mounted_by(sent: list[tuple[float, float]], T: Any = MOUNT) -> RobotPoses:
    """Return poses that have heard of a mount in two steps, at times and with stamps."""
    poses = RobotPoses(Frames(), None, BridgeClock(), lambda text: None, with_map=False)
    poses.read_transforms(tf("odom", "base_link", np.eye(4), START_S), START_S)
    for at_s, stamp_s in sent:
        # The frame below comes first: nobody knows yet where it belongs.
        poses.read_transforms(tf("mast", "camera", T, START_S + stamp_s), START_S + at_s)
        poses.read_transforms(tf("base_link", "mast", np.eye(4), START_S + stamp_s), START_S + at_s)
    return poses


@given(st.floats(0.02, 2.0), st.floats(-0.05, 5.0), st.integers(1, 6), st.floats(0.0, 1.0))
def test_a_mount_among_the_moving_transforms_is_static(period_s, ahead_s, count, share) -> None:
    """As ROS 1 sends them: stamped ahead, at any period, or once."""
    sent = [(k * period_s, k * period_s + ahead_s) for k in range(count)]
    poses = mounted_by(sent)
    last_s = sent[-1][0]
    for at_s in (0.0, last_s * share, last_s + 2.0 * period_s * share):
        assert np.array_equal(poses.in_base("camera", START_S + at_s), MOUNT)


def test_a_joint_that_has_moved_or_is_silent_is_no_mount() -> None:
    poses = mounted_by([(0.1 * k, 0.1 * k) for k in range(5)])
    assert poses.in_base("camera", START_S + 0.69) is not None
    with pytest.raises(NavError, match="known until"):
        poses.in_base("camera", START_S + 0.75)
    turned = planar(0.0, 0.0, 0.2)
    poses.read_transforms(tf("base_link", "mast", turned, START_S + 0.5), START_S + 0.5)
    with pytest.raises(NavError, match="known until"):
        poses.in_base("camera", START_S + 0.65)


def test_the_robot_s_own_pose_is_never_taken_from_ahead_or_held() -> None:
    poses = mounted_by([(0.0, 0.0)])
    ahead = tf("odom", "base_link", planar(3.0), START_S + 1.0)
    poses.read_transforms(ahead, START_S)
    poses.read_transforms(tf("odom", "wall", MOUNT, START_S), START_S)
    with pytest.raises(NavError, match="known until"):
        poses.in_base("wall", START_S + 0.3)
    assert poses.in_base("wall", START_S)[0, 3] == MOUNT[0, 3]
