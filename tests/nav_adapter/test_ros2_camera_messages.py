"""The bridge's camera: rectified topics, cut images, and frames that are not optical."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from test_ros2_bridge import INFO, START_S, Listener, image, nobody, odometry

from nav_adapter import NavError
from nav_adapter.ros2 import is_rectified, optical_problem, picture_of
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.geometry_msgs import (
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from nav_adapter.ros2.messages.sensor_msgs import Image, RegionOfInterest
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import AwarenessPipeline, Camera

# Axes of an optical frame (right, down, ahead) in a body frame (ahead, left, up).
OPTICAL = Rotation.from_matrix([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
P = (40.0, 0.0, 31.0, 0.0, 0.0, 41.0, 25.0, 0.0, 0.0, 0.0, 1.0, 0.0)
PART = RegionOfInterest(x_offset=32, y_offset=24, height=48, width=64)
# 64 x 48 px of 128 x 96 px.
CUT = replace(INFO, height=96, width=128, k=(50, 0, 64, 0, 50, 48, 0, 0, 1.0), roi=PART)


def picture(width: int, height: int, stamp_s: float = START_S) -> Image:
    data = np.random.default_rng(round(1e6 * stamp_s)).bytes(3 * width * height)
    return Image(Header(to_time(stamp_s), "camera"), height, width, "rgb8", 0, 3 * width, data)


def mounted(turn: Rotation, frame: str) -> Listener:
    """Return a bridge whose camera's frame is in tf, 1.4 m above the floor, turned like this."""
    nav = Listener(T_base_camera=None)
    move = Transform(Vector3(0.2, 0.0, 1.4), Quaternion(*turn.as_quat().tolist()))
    transforms = TFMessage((TransformStamped(Header(frame_id="base_link"), frame, move),))
    nav.bridge.on_transforms(transforms, static=True)
    nav.bridge.on_camera_info(INFO)
    nav.bridge.on_odometry(odometry(START_S))
    return nav


def seen_from(nav: Listener, frame: str) -> bool:
    shown = image(START_S)
    return nav.bridge.on_image(replace(shown, header=Header(to_time(START_S), frame)), START_S)


@pytest.mark.parametrize(
    ("topic", "rectified"),
    [
        ("/cam/image_rect", True),
        ("cam/image_rect_color", True),
        ("/cam/image_rect/compressed", True),
        ("/cam/left/image_rect_color/theora", True),
        ("/camera/color/image_rect_raw", True),
        ("/oak/rgb_rect", True),
        ("/zed/image_rectified", True),
        ("/zed/zed_node/rgb/color/rect/image/compressed", True),
        ("/cam/undistorted/image", True),
        ("/zed/zed_node/rgb/color/raw/image", False),
        ("/cam/image_raw", False),
        ("/cam/image_raw/compressed", False),
        ("/image_rect/image_raw", False),
        ("/camera/image_color", False),
        ("/direct/image", False),
        ("", False),
    ],
)
def test_the_last_part_of_a_topic_tells_whether_images_are_rectified(topic, rectified) -> None:
    assert is_rectified(topic) == rectified


def test_a_bridge_of_rectified_images_uses_p_without_distortion() -> None:
    for model, d in (("plumb_bob", (-0.3, 0.1, 0.0, 0.0, 0.0)), ("equidistant", (0.1,) * 4)):
        nav = Listener(rectified=True)
        nav.bridge.on_camera_info(replace(INFO, distortion_model=model, d=d, p=P))
        camera = nav.bridge.camera
        assert camera is not None
        assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == (40.0, 41.0, 31.0, 25.0)
        assert camera.distortion is None
    nav = Listener(rectified=True)
    nav.bridge.on_camera_info(replace(INFO, distortion_model="plumb_bob", d=(-0.3,) * 5))
    assert "the projection matrix P is needed" in nav.warnings[-1]
    assert nav.bridge.camera is None


def test_the_images_tell_whether_a_part_or_the_whole_is_delivered() -> None:
    for size, principal in (((64, 48), (32.0, 24.0)), ((128, 96), (64.0, 48.0))):
        made: list[Camera] = []

        def make(camera: Camera, made: list[Camera] = made) -> AwarenessPipeline:
            made.append(camera)
            return nobody(camera)

        nav = Listener(make_pipeline=make)
        nav.bridge.on_camera_info(CUT)
        nav.bridge.on_odometry(odometry(START_S))
        assert nav.bridge.on_image(picture(*size), START_S)
        camera = nav.bridge.camera
        assert camera is made[-1]
        assert (camera.width_px, camera.height_px) == size
        assert (camera.fx_px, camera.cx_px, camera.cy_px) == (50.0, *principal)
        # The pipeline is not made anew for each image.
        assert nav.bridge.on_image(picture(*size, START_S + 0.05), START_S + 0.05)
        assert len(made) <= 2
    assert not nav.bridge.on_image(picture(32, 24, START_S + 0.05), START_S + 0.05)
    assert "leave 64 x 48 px, but the images have 32 x 24 px" in nav.warnings[-1]


def test_a_row_that_is_shorter_than_its_pixels_is_named() -> None:
    short = replace(picture(64, 48), step=100)
    with pytest.raises(NavError, match="rows of 64 px of rgb8 need a step of at least 192 bytes"):
        picture_of(short)
    for encoding, row in (("mono16", 128), ("yuyv", 128)):
        with pytest.raises(NavError, match=f"at least {row} bytes.*got 0: the driver fills in"):
            picture_of(replace(short, encoding=encoding, step=0))


def turned(yaw_deg: float, down_deg: float, roll_deg: float = 0.0) -> Rotation:
    """Return the pose of a body frame (x ahead) that looks to the left, then down, then rolls."""
    return Rotation.from_euler("ZYX", [yaw_deg, down_deg, roll_deg], degrees=True)


@pytest.mark.parametrize(
    ("turn", "frame"),
    [
        (turned(0.0, 0.0), "camera_link"),
        (turned(40.0, 0.0), "camera_link"),
        (turned(0.0, 35.0), "camera_link"),  # its z axis, seen as the view, is only 55° up
        (turned(-90.0, -20.0), "camera_color_frame"),
        (turned(0.0, 0.0, 180.0), "camera_link"),  # upside down: the z axis points at the floor
        (turned(0.0, 0.0, 175.0), "camera_frame"),
        (turned(0.0, -70.0) * OPTICAL, "camera_optical_frame"),
        (turned(0.0, 0.0), "camera_rgb_optical_frame"),  # the name is right, the transform is not
        (turned(30.0, 45.0), "camera_optical_frame"),  # likewise, of a camera that looks down
    ],
)
def test_images_in_a_body_frame_are_refused_with_both_frames(turn, frame) -> None:
    nav = mounted(turn, frame)
    assert not seen_from(nav, frame)
    said = nav.warnings[-1]
    assert f"the frame '{frame}' of the images is not an optical frame" in said
    assert "in 'base_link'" in said
    assert "_optical_frame'" in said
    nav.bridge.tick(START_S)
    assert nav.standing()


@pytest.mark.parametrize("frame", ["camera", "camera_link", "camera_optical_frame"])
@pytest.mark.parametrize("roll_deg", [0.0, 90.0, 180.0, -90.0, 5.0])
@pytest.mark.parametrize("down_deg", [0.0, 30.0, -25.0])
@pytest.mark.parametrize("yaw_deg", [0.0, 120.0])
def test_cameras_may_be_upside_down_or_upright(frame, roll_deg, down_deg, yaw_deg) -> None:
    nav = mounted(turned(yaw_deg, down_deg, roll_deg) * OPTICAL, frame)
    assert seen_from(nav, frame), nav.warnings


def test_a_mount_in_the_robot_file_is_taken_as_it_is() -> None:
    nav = Listener()
    nav.bridge.on_camera_info(INFO)
    nav.bridge.on_odometry(odometry(START_S))
    assert seen_from(nav, "camera_link")


@given(st.floats(-180, 180), st.floats(-55, 55), st.floats(-20, 20))
def test_no_heading_and_no_tilt_of_a_body_frame_makes_it_optical(yaw, down, roll) -> None:
    pose = np.eye(4)
    pose[:3, :3] = turned(yaw, down, roll if abs(down) < 20 else 0.0).as_matrix()
    assert "points" in optical_problem(pose, "camera_link", "base_link")
    pose[:3, :3] = (turned(yaw, down, roll) * OPTICAL).as_matrix()
    assert optical_problem(pose, "camera_optical_frame", "base_link") == ""
    assert math.isclose(pose[2, 2], -math.sin(math.radians(down)), abs_tol=1e-9)
