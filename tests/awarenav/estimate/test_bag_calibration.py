"""Calibrations of recordings and folders: rectified topics, cut images, and what wins over them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from numbered_images import numbered

from awarenav.errors import AwarenavError
from awarenav.estimate import CameraChoice, open_source
from perception import Camera

pytest.importorskip("rosbags", reason="the extra 'rosbag' is not installed")

from test_image_sources_bag import COMPRESSED, IMAGE, INFO, TYPES, header, image, record

STAMP_NS = 10**9
K = [300.0, 0, 160, 0, 300, 120, 0, 0, 1]
P = [250.0, 0, 150, 0, 0, 255, 110, 0, 0, 0, 1, 0]
D = [-0.3, 0.1, 0.0, 0.0, 0.0]


def camera_info(model: str = "plumb_bob", d: list[float] = D, **changes: Any) -> Any:
    """Return a message for 320 x 240 px, the size of the numbered images."""
    roi = TYPES["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    fields = {
        "height": 240,
        "width": 320,
        "k": np.array(K),
        "p": np.array(P),
        "roi": roi,
        **changes,
    }
    return TYPES[INFO](
        header=header(STAMP_NS), distortion_model=model, d=np.array(d), r=np.eye(3).ravel(),
        binning_x=0, binning_y=0, **fields,
    )  # fmt: skip


def part(x: int, y: int, width: int, height: int) -> Any:
    return TYPES["sensor_msgs/msg/RegionOfInterest"](x, y, height, width, False)


def bag(
    path: Path, topic: str, info: Any, *, size: tuple[int, int] = (320, 240), **more: Any
) -> Path:
    picture = cv2.resize(numbered(0), size)
    kind, message = IMAGE, image(picture, "rgb8", STAMP_NS)
    if topic.endswith("/compressed"):
        data = cv2.imencode(".jpg", picture)[1].reshape(-1)
        kind, message = COMPRESSED, TYPES[COMPRESSED](header(STAMP_NS), "jpeg", data)
    topics = {topic: (kind, [(STAMP_NS, message)]), **more}
    if info is not None:
        topics["/cam/camera_info"] = (INFO, [(STAMP_NS, info)])
    return record(path, topics)


def opened(path: Path) -> Any:
    source = open_source(str(path))
    source.close()
    return source


@pytest.mark.parametrize(
    ("topic", "rectified"),
    [
        ("/cam/image_rect", True),
        ("/cam/image_rect_color/compressed", True),
        ("/cam/image_raw", False),
        ("/cam/image_raw/compressed", False),
    ],
)
def test_the_topic_tells_whether_p_or_k_is_the_camera(tmp_path, topic, rectified) -> None:
    source = opened(bag(tmp_path / "bag", topic, camera_info()))
    assert source.rectified == rectified
    wanted = (250.0, 255.0, 150.0, 110.0) if rectified else (300.0, 300.0, 160.0, 120.0)
    camera = source.camera
    assert (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) == wanted
    assert (camera.distortion is None) == rectified
    assert source.notes == ()


def test_rectified_images_of_a_fisheye_need_its_p_only(tmp_path) -> None:
    info = camera_info("equidistant", [0.1, 0.0, 0.0, 0.0], k=np.zeros(9))
    assert opened(bag(tmp_path / "bag", "/cam/image_rect", info)).camera.fx_px == 250.0


@pytest.mark.parametrize(
    ("size", "principal"), [((160, 120), (80.0, 60.0)), ((320, 240), (160.0, 120.0))]
)
def test_the_first_image_tells_whether_a_part_is_delivered(tmp_path, size, principal) -> None:
    info = camera_info(roi=part(80, 60, 160, 120))
    source = opened(bag(tmp_path / "bag", "/cam/image_raw", info, size=size))
    camera = CameraChoice.of_options(None, None, source, pytest.fail).of_size(*size)
    assert (camera.fx_px, camera.cx_px, camera.cy_px) == (300.0, *principal)


def test_images_that_neither_the_whole_nor_the_part_fits_are_refused(tmp_path) -> None:
    info = camera_info(roi=part(80, 60, 160, 120))
    source = opened(bag(tmp_path / "bag", "/cam/image_raw", info, size=(80, 60)))
    with pytest.raises(AwarenavError, match="leave 160 x 120 px, but the images have 80 x 60 px"):
        _ = source.camera


def test_what_the_user_gives_wins_over_an_unusable_calibration(tmp_path) -> None:
    source = opened(bag(tmp_path / "bag", "/cam/image_raw", camera_info("equidistant")))
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
    fields = {"image_width": 320, "image_height": 240, "camera_matrix": {"data": K}}
    fields |= {"distortion_model": "plumb_bob", "distortion_coefficients": {"data": D}}
    path.write_text(yaml.safe_dump({**fields, "projection_matrix": {"data": P}}))
    for topic, focal_px in (("/cam/image_rect", 250.0), ("/cam/image_raw", 300.0)):
        source = opened(bag(tmp_path / topic[-4:], topic, None))
        choice = CameraChoice.of_options(path, None, source, pytest.fail)
        assert choice.of_size(320, 240).fx_px == focal_px


@pytest.mark.parametrize(
    ("size", "principal"), [((160, 120), (80.0, 60.0)), ((320, 240), (160.0, 120.0))]
)
@pytest.mark.parametrize("beside", [True, False], ids=["beside", "--camera"])
def test_an_echoed_message_of_a_part_fits_whole_and_cut_images(
    tmp_path, size, principal, beside
) -> None:
    cv2.imwrite(str(tmp_path / "000000.png"), cv2.resize(numbered(0), size))
    path = tmp_path / ("camera.yaml" if beside else "echo.yaml")
    roi = {"x_offset": 80, "y_offset": 60, "height": 120, "width": 160}
    path.write_text(yaml.safe_dump({"height": 240, "width": 320, "d": D, "k": K, "roi": roi}))
    source = open_source(str(tmp_path))
    choice = CameraChoice.of_options(None if beside else path, None, source, pytest.fail)
    camera = choice.of_size(*size)
    assert (camera.fx_px, camera.cx_px, camera.cy_px) == (300.0, *principal)


def transform(parent: str, child: str, x: float, y: float, z: float, w: float) -> Any:
    move = TYPES["geometry_msgs/msg/Transform"](
        TYPES["geometry_msgs/msg/Vector3"](0.2, 0.0, 1.0),
        TYPES["geometry_msgs/msg/Quaternion"](x, y, z, w),
    )
    head = TYPES["std_msgs/msg/Header"](TYPES["builtin_interfaces/msg/Time"](0, 0), parent)
    return TYPES["geometry_msgs/msg/TransformStamped"](head, child, move)


def test_images_in_a_body_frame_are_noted(tmp_path) -> None:
    """The images of these tests are in the frame ``camera``."""
    kind = "tf2_msgs/msg/TFMessage"
    mast = transform("base_link", "mast", 0.0, 0.0, 0.0, 1.0)
    for name, turn, said in (
        ("body", (0.0, 0.0, 0.0, 1.0), True),
        ("optical", (-0.5, 0.5, -0.5, 0.5), False),
    ):
        tf = TYPES[kind]([mast, transform("mast", "camera", *turn)])
        static = {"/tf_static": (kind, [(STAMP_NS, tf)])}
        source = opened(bag(tmp_path / name, "/cam/image_raw", camera_info(), **static))
        assert len(source.notes) == said
        if said:
            assert "the frame 'camera' of the images is not an optical frame" in source.notes[0]
            assert "90 degrees up in 'base_link'" in source.notes[0]
