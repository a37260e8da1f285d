"""Recordings of image topics: which topic, which frames, which calibration."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from numbered_images import number_of, numbered

from awarenav.errors import AwarenavError
from awarenav.estimate import (
    CameraChoice,
    PeopleEstimator,
    SourceFrame,
    fixed_camera_pose,
    open_source,
)
from nav_adapter.rigid import Motion
from nav_adapter.ros2.conversions import to_time, yaw_quaternion
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import (
    CameraInfo,
    CompressedImage,
    Image,
    RegionOfInterest,
)
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import AwarenessPipeline, Camera, PersonObservation

pytest.importorskip("rosbags", reason="the extra 'rosbag' is not installed")

from recorded_messages import recorded
from rosbags.rosbag2 import StoragePlugin

K = (300.0, 0.0, 160.0, 0.0, 310.0, 120.0, 0.0, 0.0, 1.0)
P = (250.0, 0.0, 150.0, 0.0, 0.0, 255.0, 110.0, 0.0, 0.0, 0.0, 1.0, 0.0)
D = (-0.3, 0.1, 0.0, 0.0, 0.0)
PART = RegionOfInterest(80, 60, 120, 160)


def image(number: int, stamp_s: float = 1.0, *, size: tuple[int, int] = (320, 240)) -> Image:
    pixels = numbered(number, size)
    header = Header(to_time(stamp_s), "camera")
    return Image(header, size[1], size[0], "rgb8", 0, 3 * size[0], pixels.tobytes())


def compressed(number: int, stamp_s: float = 1.0) -> CompressedImage:
    data = cv2.imencode(".jpg", numbered(number))[1].tobytes()
    return CompressedImage(Header(to_time(stamp_s), "camera"), "jpeg", data)


def camera_info(model: str = "plumb_bob", d: tuple[float, ...] = D, **changes: Any) -> CameraInfo:
    """Return a calibration for 320 x 240 px, the size of the images."""
    fields = {"k": K, "p": P, **changes}
    return CameraInfo(Header(to_time(1.0), "camera"), 240, 320, model, d, **fields)


def bag(path: Path, **topics: Any) -> Path:
    """Record one message or several a topic, by its name with ``__`` for the slash."""
    found: list[tuple[str, float, Message]] = []
    for name, messages in topics.items():
        each = messages if isinstance(messages, list) else [messages]
        found += [(name.replace("__", "/"), 1.0 + 0.05 * k, one) for k, one in enumerate(each)]
    return recorded(path, found)


def opened(path: Path, topic: str | None = None) -> Any:
    source = open_source(str(path), topic=topic)
    source.close()
    return source


def frames_of(path: Path, topic: str | None = None) -> list[Any]:
    source = open_source(str(path), topic=topic)
    found = list(source.frames())
    source.close()
    return found


@pytest.mark.parametrize(
    ("name", "slash"), [("image_raw", "/"), ("__image_raw", ""), ("front__image_raw", "/")]
)
def test_a_topic_without_a_leading_slash_is_the_same_topic(tmp_path, name, slash):
    info = {name.replace("image_raw", "camera_info"): camera_info()}
    others = {"rear__image_raw": [image(9), image(9)]}
    path = bag(tmp_path / "bag", **{name: [image(0), image(1)]}, **others, **info)
    topic = slash + name.replace("__", "/").strip("/")
    assert [number_of(frame.image_rgb) for frame in frames_of(path, topic)] == [0, 1]
    assert opened(path, topic).camera.fx_px == 300.0


@pytest.mark.parametrize(
    ("plugin", "inside"), [(StoragePlugin.SQLITE3, True), (StoragePlugin.MCAP, False)]
)
def test_images_stamps_and_camera_come_from_the_recording(tmp_path, plugin, inside):
    stamps_s = [1.0 + 0.05 * k for k in range(6)]
    late_s = 0.007  # between the header's stamp and the recorder's
    found = [("/cam/image_raw", t + late_s, image(k, t)) for k, t in enumerate(stamps_s)]
    path = recorded(tmp_path / "bag", [*found, ("/cam/camera_info", 1.0, camera_info())], plugin)
    if inside:
        (path,) = (each for each in path.iterdir() if each.suffix in (".db3", ".mcap"))
    frames = frames_of(path)
    assert [frame.stamp_s for frame in frames] == pytest.approx(stamps_s)
    assert [number_of(frame.image_rgb) for frame in frames] == list(range(6))
    source = opened(path)
    assert source.count == 6
    assert (source.camera.fx_px, source.camera.fy_px) == (300.0, 310.0)
    assert source.camera.distortion[0] == -0.3


def test_images_that_cannot_be_decoded_are_frames_with_a_problem(tmp_path):
    cut = CompressedImage(Header(to_time(1.0), "camera"), "jpeg", compressed(1).data[:40])
    path = bag(tmp_path / "bag", __cam__image_raw__compressed=[compressed(0), cut, compressed(2)])
    first, second, third = frames_of(path)
    assert (number_of(first.image_rgb), number_of(third.image_rgb)) == (0, 2)
    assert second.image_rgb is None
    assert "message 1" in second.problem
    short = Image(Header(to_time(1.0), "camera"), 240, 320, "rgb8", 0, 960, bytes(100))
    (frame,) = frames_of(bag(tmp_path / "short", __image=short))
    assert "need 230400 bytes" in frame.problem


def test_one_of_several_topics_has_to_be_chosen(tmp_path):
    path = bag(tmp_path / "bag", __a__image=image(0), __b__image=image(1))
    several = r"several image topics: choose --topic /a/image \| /b/image"
    for topic, message in ((None, several), ("/c", "--topic must be one of /a/image, /b/image")):
        with pytest.raises(AwarenavError, match=message):
            open_source(str(path), topic=topic)
    assert [number_of(frame.image_rgb) for frame in frames_of(path, "/b/image")] == [1]


def test_recordings_without_images_and_other_files_are_refused(tmp_path):
    with pytest.raises(AwarenavError, match="no topic of type"):
        open_source(str(bag(tmp_path / "bag", __camera_info=camera_info())))
    for name in ("broken.db3", "broken.mcap"):
        (tmp_path / name).write_bytes(b"not a recording at all, however long it is read")
        with pytest.raises(AwarenavError, match="cannot read the recording"):
            open_source(str(tmp_path / name))


# --- calibrations -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "rectified", "info"),
    [
        # Of a fisheye only P is needed.
        ("image_rect", True, camera_info("equidistant", (0.1, 0.0, 0.0, 0.0), k=(0.0,) * 9)),
        ("image_rect_color__compressed", True, camera_info()),
        ("image_raw", False, camera_info()),
        ("image_raw__compressed", False, camera_info()),
    ],
)
def test_the_topic_tells_whether_p_or_k_is_the_camera(tmp_path, name, rectified, info) -> None:
    picture = compressed(0) if name.endswith("compressed") else image(0)
    topics = {f"__cam__{name}": picture, "__cam__camera_info": info}
    source = opened(bag(tmp_path / "bag", **topics))
    assert source.rectified == rectified
    wanted = (250.0, 255.0, 150.0, 110.0) if rectified else (300.0, 310.0, 160.0, 120.0)
    camera = source.camera
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == wanted
    assert (camera.distortion is None) == rectified
    assert source.notes == ()


@pytest.mark.parametrize("given", ["recording", "beside", "--camera"])
@pytest.mark.parametrize(
    ("size", "principal"), [((160, 120), (80.0, 60.0)), ((320, 240), (160.0, 120.0))]
)
def test_the_first_image_tells_whether_a_part_is_delivered(
    tmp_path, given, size, principal
) -> None:
    file = None
    if given == "recording":
        picture, info = image(0, size=size), camera_info(roi=PART)
        path = bag(tmp_path / "bag", __cam__image_raw=picture, __cam__camera_info=info)
        source = opened(path)
    else:  # `ros2 topic echo`
        cv2.imwrite(str(tmp_path / "000000.png"), numbered(0, size))
        echo = tmp_path / ("camera.yaml" if given == "beside" else "echo.yaml")
        roi = {"x_offset": 80, "y_offset": 60, "height": 120, "width": 160}
        fields = {"height": 240, "width": 320, "d": [*D], "k": [*K], "roi": roi}
        echo.write_text(yaml.safe_dump(fields))
        source, file = open_source(str(tmp_path)), None if given == "beside" else echo
    camera = CameraChoice.of_options(file, None, source, pytest.fail).of_size(*size)
    assert (camera.fx_px, camera.cx_px, camera.cy_px) == (300.0, *principal)


def test_what_the_user_gives_wins_over_an_unusable_calibration(tmp_path) -> None:
    info = camera_info("equidistant")
    source = opened(bag(tmp_path / "bag", __cam__image_raw=image(0), __cam__camera_info=info))
    with pytest.raises(AwarenavError, match=r"/cam/camera_info: .*'equidistant'"):
        CameraChoice.of_options(None, None, source, pytest.fail)
    choice = CameraChoice.of_options(None, 70.0, source, pytest.fail)
    assert (choice.known, choice.calibrated) == (True, False)
    assert choice.of_size(320, 240).fx_px == pytest.approx(160 / math.tan(math.radians(35)))
    mine = tmp_path / "mine.yaml"
    Camera.from_fov(320, 240, 1.0).to_yaml(mine)
    choice = CameraChoice.of_options(mine, None, source, pytest.fail)
    assert choice.calibrated
    assert choice.of_size(320, 240).fx_px == Camera.from_yaml(mine).fx_px


def test_a_file_is_for_the_rectified_images_of_a_rectified_topic(tmp_path) -> None:
    """The file of the calibrator holds both matrices."""
    path = tmp_path / "ost.yaml"
    fields = {"image_width": 320, "image_height": 240, "camera_matrix": {"data": [*K]}}
    fields |= {"distortion_model": "plumb_bob", "distortion_coefficients": {"data": [*D]}}
    path.write_text(yaml.safe_dump({**fields, "projection_matrix": {"data": [*P]}}))
    for name, focal_px in (("image_rect", 250.0), ("image_raw", 300.0)):
        source = opened(bag(tmp_path / name, **{f"__cam__{name}": image(0)}))
        choice = CameraChoice.of_options(path, None, source, pytest.fail)
        assert choice.of_size(320, 240).fx_px == focal_px


def mounted(parent: str, child: str, *turn: float) -> TransformStamped:
    move = Transform(Vector3(0.2, 0.0, 1.0), Quaternion(*turn))
    return TransformStamped(Header(frame_id=parent), child, move)


@pytest.mark.parametrize(
    ("turn", "noted"), [((0.0, 0.0, 0.0, 1.0), True), ((-0.5, 0.5, -0.5, 0.5), False)]
)
def test_images_in_a_body_frame_are_noted(tmp_path, turn, noted) -> None:
    """The images of these tests are in the frame ``camera``."""
    mast = mounted("base_link", "mast", 0.0, 0.0, 0.0, 1.0)
    static = TFMessage((mast, mounted("mast", "camera", *turn)))
    notes = opened(bag(tmp_path / "bag", __cam__image_raw=image(0), __tf_static=static)).notes
    assert len(notes) == noted
    if noted:
        assert "the frame 'camera' of the images is not an optical frame" in notes[0]
        assert "90 degrees up in 'base_link'" in notes[0]


DRIVES = Motion(1.0, 2.0, 0.5, 0.8, 0.0, 0.6)


def odom_messages(kind: str, at_s: float) -> Message:
    """Return where a robot on a curve is at a time, as one topic or the other has it."""
    motion = DRIVES.at(at_s)
    stamp, turn = to_time(at_s), yaw_quaternion(motion.heading_rad)
    if kind == "odom":
        pose = PoseWithCovariance(Pose(Point(motion.x_m, motion.y_m, 0.0), turn))
        return Odometry(Header(stamp, "odom"), "base_link", pose)
    move = Transform(Vector3(motion.x_m, motion.y_m, 0.0), turn)
    return TFMessage((TransformStamped(Header(stamp, "odom"), "base_link", move),))


@pytest.mark.parametrize("kind", ["odom", "tf"])
@pytest.mark.parametrize("late_s", [0.0, 0.15, -0.02])
def test_a_camera_on_a_robot_that_drives_has_its_pose_in_odom(tmp_path, kind, late_s) -> None:
    """Odometry at 20 Hz, images between its stamps; either may be recorded after the other."""
    optical = TFMessage((mounted("base_link", "camera", -0.5, 0.5, -0.5, 0.5),))
    found = [("/tf_static", 1.0, optical)]
    found += [(f"/{kind}", 1.0 + 0.05 * k, odom_messages(kind, 1.0 + 0.05 * k)) for k in range(30)]
    stamps_s = [1.02 + 0.1 * k for k in range(12)]
    found += [("/cam/image_raw", t + late_s, image(k, t)) for k, t in enumerate(stamps_s)]
    path = recorded(tmp_path / "bag", sorted(found, key=lambda each: each[1]))
    frames = frames_of(path)
    assert [frame.stamp_s for frame in frames] == pytest.approx(stamps_s)
    for frame in frames:
        motion = DRIVES.at(frame.stamp_s)
        ahead = np.array([math.cos(motion.heading_rad), math.sin(motion.heading_rad), 0.0])
        wanted = np.array([motion.x_m, motion.y_m, 1.0]) + 0.2 * ahead
        np.testing.assert_allclose(frame.T_odom_camera[:3, 3], wanted, atol=1e-6)
        np.testing.assert_allclose(frame.T_odom_camera[:3, 2], ahead, atol=1e-6)
        assert frame.on_robot


class FloorKeeper:
    """Perception that finds nobody, and keeps the floors that it is given."""

    def __init__(self) -> None:
        self.floors: list[Any] = []

    def process(self, image_rgb: Any, stamp_s: float, *, floor: Any, up_camera: Any) -> tuple[()]:
        self.floors.append(floor)
        return ()


# A typed height of 1.2 m, or none; whether a robot has measured the pose; its height in odom.
@pytest.mark.parametrize(
    ("typed", "on_robot", "height_m", "wanted_m", "std_m"),
    [
        (False, False, 1.0, 1.0, 0.02),
        (False, True, 1.0, 1.0, 0.05),
        (True, False, 1.0, 1.0, 0.02),
        (True, True, 1.0, 1.2, 0.05),  # odom may begin at the camera
        (True, True, 0.0, 1.2, 0.05),
        (False, True, 0.0, None, None),
        (True, False, None, 1.2, 0.05),
        (False, False, None, None, None),
    ],
)
def test_the_floor_is_that_of_an_exact_pose_then_of_a_typed_height_then_of_the_robots(
    typed, on_robot, height_m, wanted_m, std_m, monkeypatch
) -> None:
    seen = FloorKeeper()
    monkeypatch.setattr(AwarenessPipeline, "of", lambda networks, camera: seen)
    pose = None if height_m is None else fixed_camera_pose(height_m)
    fixed = fixed_camera_pose(1.2) if typed else None
    cameras = CameraChoice(None, 60.0, lambda text: None)
    estimator = PeopleEstimator(None, cameras, fixed_pose_odom_camera=fixed)  # type: ignore[arg-type]
    estimator.estimate(SourceFrame("0", 1.0, numbered(0), pose, on_robot=on_robot))
    (floor,) = seen.floors
    assert (floor and floor.height_m) == wanted_m
    assert (floor and floor.height_std_m) == std_m


class SomebodyStands:
    """Perception of somebody who stands 9 m along x of odom, of a camera that drives at 1 m/s."""

    def process(self, image_rgb: Any, stamp_s: float, **_: Any) -> tuple[PersonObservation]:
        place, spread_m2 = [0.0, 0.2, 9.0 - stamp_s], np.diag([0.05, 0.05, 0.1]) ** 2
        return (PersonObservation(stamp_s, place, spread_m2, None, None, None, score=0.9),)


@pytest.mark.parametrize("typed", [True, False])
@pytest.mark.parametrize("without", [range(5), range(30, 34), range(30, 60)])
def test_people_keep_their_place_while_a_robots_pose_is_not_known(
    typed, without, monkeypatch
) -> None:
    """Images before its first pose, and in a gap of its odometry, are not those of a fixed one."""
    monkeypatch.setattr(AwarenessPipeline, "of", lambda networks, camera: SomebodyStands())
    fixed = fixed_camera_pose(1.2) if typed else None
    cameras = CameraChoice(None, 60.0, lambda text: None)
    estimator = PeopleEstimator(None, cameras, fixed_pose_odom_camera=fixed, track=True)  # type: ignore[arg-type]
    for k in range(60):
        pose = fixed_camera_pose(1.0)
        pose[0, 3] = 0.1 * k
        known = None if k in without else pose
        frame = SourceFrame(str(k), 0.1 * k, numbered(k % 20), known, on_robot=True)
        estimate = estimator.estimate(frame)
        if k < 5 and known is None:
            continue
        assert (estimate.T_odom_camera is None) == (known is None)
        for track in estimate.tracks or ():
            assert track.position_odom_m == pytest.approx([9.0, 0.0], abs=0.1)


@pytest.mark.parametrize("topics", [("tf_static",), ("odom",), ("odom", "body")])
def test_a_camera_whose_way_to_odom_is_not_recorded_has_no_pose(tmp_path, topics) -> None:
    """Nor has one whose images are in a frame of the body, not in an optical one."""
    level = (0.0, 0.0, 0.0, 1.0)
    turn = level if "body" in topics else (-0.5, 0.5, -0.5, 0.5)
    found: list[tuple[str, float, Message]] = [("/cam/image_raw", 1.1, image(0, 1.1))]
    if "odom" in topics:
        found += [("/odom", 1.0 + 0.1 * k, odom_messages("odom", 1.0 + 0.1 * k)) for k in range(3)]
    if topics != ("odom",):
        mount = TFMessage((mounted("base_link", "camera", *turn),))
        found += [("/tf_static", 1.0, mount)]
    (frame,) = frames_of(recorded(tmp_path / "bag", sorted(found, key=lambda each: each[1])))
    assert frame.T_odom_camera is None


@pytest.mark.parametrize(
    ("name", "info"),
    [
        ("__left__image_rect", "__left__camera_info_rect"),
        ("__cam0__image_raw", "__cam0__info"),
        ("__camera__rgb__image_raw", "__camera__rgb__image_raw_info"),
        ("__front__image_raw__compressed", "__front__calibration"),
    ],
)
def test_a_calibration_under_another_name_beside_the_images_is_theirs(tmp_path, name, info) -> None:
    picture = compressed(0) if name.endswith("compressed") else image(0)
    other = replace(camera_info(), header=Header(to_time(1.0), "another_camera"))
    topics = {name: picture, info: camera_info(), "__rear__camera_info": other}
    source = opened(bag(tmp_path / "bag", **topics))
    assert source.camera.fx_px == (250.0 if "rect" in name else 300.0)
    assert source.notes == ()


def test_a_calibration_of_another_camera_is_named_and_not_used(tmp_path) -> None:
    other = replace(camera_info(), header=Header(to_time(1.0), "another_camera"))
    two = {"__left__image_raw": image(0), "__left__right_info": other, "__a__camera_info": other}
    source = opened(bag(tmp_path / "bag", **two))
    assert source.camera is None
    (note,) = source.notes
    assert "calibrations are in /a/camera_info, /left/right_info" in note
    assert note.endswith("give --camera")
