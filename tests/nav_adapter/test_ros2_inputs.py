"""Images, calibration, frames, transforms and the robot file of the bridge."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import cv2
import numpy as np
import pytest
from bridge_scenes import INFO, START_S, Listener, image, nobody, odometry, tf
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import finite
from scipy.spatial.transform import Rotation

from awarenav import AwarenavError
from awarenav.estimate._pictures import as_rgb
from nav_adapter import NavError
from nav_adapter.ros2 import CameraMount, TransformBuffer, is_rectified, optical_problem, picture_of
from nav_adapter.ros2.conversions import pose_matrix, to_time, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import Point, Quaternion
from nav_adapter.ros2.messages.sensor_msgs import CompressedImage, Image, RegionOfInterest
from nav_adapter.ros2.messages.std_msgs import Header
from perception import AwarenessPipeline, Camera

RGB = np.random.default_rng(5).integers(0, 256, (4, 6, 3), dtype=np.uint8)
SMOOTH = np.full((16, 16, 3), (200, 90, 30), np.uint8)


def raw(pixels: np.ndarray, encoding: str, padding: int = 0) -> Image:
    rows = pixels.reshape(len(pixels), -1)
    padded = np.pad(rows, [(0, 0), (0, padding)])
    return Image(
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        step=padded.shape[1],
        data=padded.tobytes(),
    )


@pytest.mark.parametrize("padding", [0, 5])
@pytest.mark.parametrize(
    ("encoding", "code"),
    [
        ("rgb8", None),
        ("bgr8", cv2.COLOR_RGB2BGR),
        ("8UC3", cv2.COLOR_RGB2BGR),
        ("rgba8", cv2.COLOR_RGB2RGBA),
        ("bgra8", cv2.COLOR_RGB2BGRA),
    ],
)
def test_colours_are_converted_exactly(encoding: str, code: int | None, padding: int) -> None:
    pixels = RGB if code is None else cv2.cvtColor(RGB, code)
    read = picture_of(raw(pixels, encoding, padding))
    assert np.array_equal(read, RGB)
    assert read.flags.c_contiguous


@pytest.mark.parametrize("big", [False, True], ids=["little", "big"])
@pytest.mark.parametrize("encoding", ["rgb16", "bgr16", "mono16"])
def test_16_bit_values_are_scaled_over_their_full_range(encoding: str, big: bool) -> None:
    pixels = {"rgb16": RGB, "bgr16": RGB[:, :, ::-1], "mono16": RGB[:, :, :1]}[encoding]
    samples = (pixels.astype(np.uint16) * 257).astype(">u2" if big else "<u2")
    message = replace(
        raw(samples.view(np.uint8), encoding, 3), width=RGB.shape[1], is_bigendian=int(big)
    )
    expected = RGB if encoding != "mono16" else np.repeat(RGB[:, :, :1], 3, axis=2)
    assert np.array_equal(picture_of(message), expected)


def test_the_orientation_in_an_image_file_is_ignored() -> None:
    """The calibration is for the pixels as stored."""
    tall = np.zeros((64, 32, 3), np.uint8)
    tall[:16] = 250
    plain = cv2.imencode(".jpg", tall)[1].tobytes()
    # Exif with one entry: orientation (0x0112) 6, "turn right".
    tiff = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"
    exif = b"Exif\0\0" + tiff
    claimed = plain[:2] + b"\xff\xe1" + (len(exif) + 2).to_bytes(2, "big") + exif + plain[2:]
    turned = cv2.imdecode(np.frombuffer(claimed, np.uint8), cv2.IMREAD_COLOR)
    assert turned.shape == (32, 64, 3)  # OpenCV applies it by default
    read = picture_of(CompressedImage(format="jpeg", data=claimed))
    assert np.array_equal(read, picture_of(CompressedImage(format="jpeg", data=plain)))
    assert read.shape == (64, 32, 3)


@pytest.mark.parametrize(
    ("encoding", "first", "second"),
    [
        ("bayer_rggb8", "RG", "GB"),
        ("bayer_bggr8", "BG", "GR"),
        ("bayer_gbrg8", "GB", "RG"),
        ("bayer_grbg8", "GR", "BG"),
    ],
)
def test_bayer_patterns_give_the_colour_of_the_sensor(encoding, first, second) -> None:
    mosaic = np.zeros((16, 16, 1), np.uint8)
    for row, letters in enumerate((first, second)):
        for column, letter in enumerate(letters):
            mosaic[row::2, column::2, 0] = SMOOTH[0, 0, "RGB".index(letter)]
    assert np.array_equal(picture_of(raw(mosaic, encoding))[4:-4, 4:-4], SMOOTH[4:-4, 4:-4])


@pytest.mark.parametrize(("suffix", "tolerance"), [(".png", 0), (".jpg", 6)])
def test_compressed_images_are_decoded(suffix: str, tolerance: int) -> None:
    data = cv2.imencode(suffix, SMOOTH[:, :, ::-1])[1].tobytes()
    read = picture_of(CompressedImage(format=suffix, data=data))
    assert np.abs(read.astype(int) - SMOOTH).max() <= tolerance


@pytest.mark.parametrize(
    "message",
    [
        Image(),
        Image(height=2, width=2, encoding="rgb8", step=6, data=bytes(11)),
        Image(height=2, width=2, encoding="rgb8", step=5, data=bytes(12)),
        Image(height=2, width=2, encoding="32FC1", step=8, data=bytes(16)),
        Image(height=4_000_000_000, width=4_000_000_000, encoding="rgb8", step=6, data=bytes(12)),
        Image(height=1, width=1, encoding="yuyv", step=2, data=bytes(2)),
        CompressedImage(),
        CompressedImage(format="jpeg", data=b"\xff\xd8 not a picture"),
        CompressedImage(format="jpeg", data=cv2.imencode(".png", RGB)[1].tobytes()[:40]),
    ],
)
def test_images_that_cannot_be_read_are_refused(message) -> None:
    with pytest.raises(NavError):
        picture_of(message)


poses = st.builds(
    lambda x, y, z, turn: pose_matrix(Point(x, y, z), Quaternion(*turn)),
    *[finite(-5.0, 5.0)] * 3,
    st.tuples(*[finite(-1.0, 1.0)] * 4).filter(lambda q: 0.6 < np.linalg.norm(q) < 1.9),
)


@given(poses, poses, poses)
def test_lookups_compose_and_invert(first, second, third) -> None:
    buffer = TransformBuffer()
    buffer.add("odom", "base", 1.0, first)
    buffer.add("base", "mast", 0.0, second, static=True)
    buffer.add("/mast", "camera", 0.0, third, static=True)
    forward = buffer.lookup("odom", "camera", 1.0)
    assert np.allclose(forward, first @ second @ third)
    assert np.allclose(forward @ buffer.lookup("camera", "/odom", 1.0), np.eye(4))
    assert np.array_equal(buffer.lookup("mast", "mast", 9.0), np.eye(4))
    assert np.allclose(
        buffer.lookup("odom", "mast", 1.0) @ buffer.lookup("mast", "camera", 1.0), forward
    )


@given(poses, poses, poses, finite(-1.0, 1.0))
def test_between_two_stamps_a_frame_moves_at_constant_velocity_in_itself(
    start, seen_from, mount, share
):
    """It is the same motion from whichever frame it is seen, and of whichever point of the body."""
    step = pose_matrix(Point(0.3, -0.2, 0.1), yaw_quaternion(share))
    lookups = []
    for before, after in ((np.eye(4), np.eye(4)), (seen_from, mount)):
        buffer = TransformBuffer()
        for stamp_s, T in ((10.0, start), (10.4, start @ step)):
            buffer.add("odom", "base", stamp_s, before @ T @ after)
        lookups.append([buffer.lookup("odom", "base", 10.0 + 0.1 * n) for n in range(5)])
    bare, framed = lookups
    for T, other in zip(bare, framed, strict=True):
        assert np.allclose(seen_from @ T @ mount, other, atol=1e-6)
    steps = [np.linalg.inv(T) @ later for T, later in pairwise(bare)]
    for each in steps[1:]:
        assert np.allclose(each, steps[0], atol=1e-6)


def test_a_lookup_outside_the_known_times_is_refused_with_the_times() -> None:
    buffer = TransformBuffer()
    buffer.add("odom", "base", 10.0, np.eye(4))
    assert np.array_equal(buffer.lookup("odom", "base", 10.1), np.eye(4))
    with pytest.raises(NavError, match=r"wanted at 10\.150 s and known until 10\.000 s"):
        buffer.lookup("odom", "base", 10.15)
    with pytest.raises(NavError, match=r"wanted at 9\.900 s and known from 10\.000 s"):
        buffer.lookup("odom", "base", 9.9)
    for tick in range(100):
        buffer.add("odom", "base", 11.0 + 0.1 * tick, np.eye(4))
    with pytest.raises(NavError, match="known from"):
        buffer.lookup("odom", "base", 11.0)


def test_late_transforms_are_inserted_in_order() -> None:
    buffer = TransformBuffer()
    for stamp_s in (1.0, 1.2, 1.1):
        buffer.add("odom", "base", stamp_s, pose_matrix(Point(stamp_s), Quaternion()))
    assert buffer.lookup("odom", "base", 1.15)[0, 3] == pytest.approx(1.15)


def test_frames_that_are_not_connected_are_refused_by_name() -> None:
    buffer = TransformBuffer()
    buffer.add("odom", "base", 0.0, np.eye(4), static=True)
    with pytest.raises(NavError, match="between 'camera' and 'odom': known are odom -> base"):
        buffer.lookup("odom", "camera", 0.0)
    with pytest.raises(NavError, match="tree"):
        buffer.add("base", "odom", 0.0, np.eye(4))
    with pytest.raises(NavError, match="tree"):
        buffer.add("odom", "odom", 0.0, np.eye(4))


def test_a_camera_mount_looks_in_its_direction() -> None:
    mount = CameraMount(position_base_m=[0.2, 0.1, 1.4], yaw_deg=90.0, pitch_down_deg=30.0)
    T = mount.T_base_camera()
    ahead, down = T[:3, 2], T[:3, 1]
    assert np.allclose(ahead, [0.0, math.cos(math.radians(30)), -math.sin(math.radians(30))])
    assert down[2] == pytest.approx(-math.cos(math.radians(30)))
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3))
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    assert T[:3, 3].tolist() == [0.2, 0.1, 1.4]


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
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn.as_matrix(), (0.2, 0.0, 1.4)
    nav.bridge.on_transforms(tf("base_link", frame, T), static=True)
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
        ("/camera/color/image_rect_raw", True),
        ("/zed/zed_node/rgb/color/rect/image/compressed", True),
        ("/cam/undistorted/image", True),
        ("/zed/zed_node/rgb/color/raw/image", False),
        ("/cam/image_raw", False),
        ("/image_rect/image_raw", False),
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
@pytest.mark.parametrize("roll_deg", [90.0, 180.0, 5.0])
@pytest.mark.parametrize(("yaw_deg", "down_deg"), [(0.0, 30.0), (120.0, -25.0)])
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


@pytest.mark.parametrize(
    ("low", "high"), [(51241, 52181), (29500, 31000), (0, 1000), (300, 300), (60000, 62500)]
)
def test_16_bit_counts_that_use_little_of_their_range_are_refused_with_the_cure(low, high) -> None:
    rng = np.random.default_rng(0)
    counts = np.rint(rng.uniform(low, high, (48, 64))).astype("<u2")
    for encoding in ("mono16", "rgb16"):
        samples = counts if encoding == "mono16" else np.repeat(counts[..., None], 3, axis=2)
        sent = Image(Header(), 48, 64, encoding, 0, samples.strides[0], samples.tobytes())
        with pytest.raises(NavError, match="scale them to 8 bits first"):
            picture_of(sent)
    with pytest.raises(AwarenavError, match=r"a\.png: its 16-bit values lie between"):
        as_rgb(counts, "a.png")
    wide = rng.integers(0, 16384, (48, 64)).astype("<u2")  # 14 bits
    assert picture_of(Image(Header(), 48, 64, "mono16", 0, 128, wide.tobytes())).max() > 60


def test_raw_counts_under_the_encoding_of_depth_get_the_hint() -> None:
    with pytest.raises(NavError, match="scale these to mono8"):
        picture_of(Image(Header(), 2, 2, "16UC1", 0, 4, bytes(8)))


def test_a_robot_whose_calibration_is_that_of_no_lens_stands_and_says_so() -> None:
    nav = Listener()
    nav.bridge.on_odometry(odometry(START_S))
    assert nav.bridge.tick(START_S).limited_by == "no camera_info yet"
    nav.bridge.on_camera_info(replace(INFO, distortion_model="plumb_bob", d=(-3.0, 0, 0, 0, 0)))
    assert "is that of no lens" in nav.warnings[-1]
    assert nav.bridge.tick(START_S).limited_by == "the camera_info that comes cannot be used"
    nav.bridge.on_camera_info(INFO)
    assert nav.bridge.camera is not None
