"""Recordings of image topics, written here and read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numbered_images import number_of, numbered

from awarenav.errors import AwarenavError
from awarenav.estimate import open_source

pytest.importorskip("rosbags", reason="the extra 'rosbag' is not installed")

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES: Any = STORE.types
IMAGE, COMPRESSED, INFO = (
    f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "CameraInfo")
)


def header(stamp_ns: int) -> Any:
    time = TYPES["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    return TYPES["std_msgs/msg/Header"](time, "camera")


def image(pixels: np.ndarray, encoding: str, stamp_ns: int, *, padding: int = 0) -> Any:
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(pixels.shape[0], -1)
    rows = np.pad(rows, ((0, 0), (0, padding)))
    height, width = pixels.shape[:2]
    return TYPES[IMAGE](
        header(stamp_ns), height, width, encoding, 0, rows.shape[1], rows.reshape(-1)
    )


def camera_info(stamp_ns: int) -> Any:
    roi = TYPES["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    matrix = np.array([300.0, 0.0, 160.0, 0.0, 310.0, 120.0, 0.0, 0.0, 1.0])
    return TYPES[INFO](
        header(stamp_ns), 240, 320, "plumb_bob", np.array([-0.1, 0.01, 0.0, 0.0, 0.0]), matrix,
        np.eye(3).reshape(-1), np.zeros(12), 0, 0, roi,
    )  # fmt: skip


def record(path: Path, topics: dict[str, tuple[str, list[tuple[int, Any]]]], plugin=None) -> Path:
    plugin = StoragePlugin.SQLITE3 if plugin is None else plugin
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        for topic, (kind, messages) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=STORE)
            for stamp_ns, message in messages:
                writer.write(connection, stamp_ns, STORE.serialize_cdr(message, kind))
    return path


def stamps(count: int) -> list[int]:
    return [10**9 + 50_000_000 * k for k in range(count)]


@pytest.mark.parametrize(
    ("recorded", "slash"), [("image_raw", "/"), ("/image_raw", ""), ("front/image_raw", "/")]
)
def test_a_topic_without_a_leading_slash_is_the_same_topic(tmp_path, recorded, slash):
    info = recorded.replace("image_raw", "camera_info")
    images = [(t, image(numbered(k), "rgb8", t)) for k, t in enumerate(stamps(2))]
    others = [(t, image(numbered(9), "rgb8", t)) for t in stamps(2)]
    path = record(
        tmp_path / "bag",
        {
            recorded: (IMAGE, images),
            "rear/image_raw": (IMAGE, others),
            info: (INFO, [(t, camera_info(t)) for t in stamps(1)]),
        },
    )
    source = open_source(str(path), topic=f"{slash}{recorded.strip('/')}")
    assert [number_of(frame.image_rgb) for frame in source.frames()] == [0, 1]
    source.close()
    assert source.camera is not None
    assert source.camera.fx_px == 300.0


@pytest.mark.parametrize(
    ("plugin", "inside"), [(StoragePlugin.SQLITE3, True), (StoragePlugin.MCAP, False)]
)
def test_images_stamps_and_camera_come_from_the_recording(tmp_path, plugin, inside):
    late_ns = 7_000_000  # between the header's stamp and the recorder's
    images = [(t + late_ns, image(numbered(k), "rgb8", t)) for k, t in enumerate(stamps(6))]
    path = record(
        tmp_path / "bag",
        {
            "/front/image_raw": (IMAGE, images),
            "/front/camera_info": (INFO, [(t, camera_info(t)) for t in stamps(2)]),
        },
        plugin,
    )
    if inside:
        (path,) = (each for each in path.iterdir() if each.suffix in (".db3", ".mcap"))
    source = open_source(str(path))
    frames = list(source.frames())
    source.close()
    assert [frame.stamp_s for frame in frames] == pytest.approx([t * 1e-9 for t in stamps(6)])
    assert [number_of(frame.image_rgb) for frame in frames] == list(range(6))
    assert source.count == 6
    assert source.camera.fx_px == 300.0
    assert source.camera.fy_px == 310.0
    assert source.camera.distortion[0] == -0.1


def bgr_of(rgb: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(rgb[..., ::-1])


PATCHES = np.zeros((8, 12, 3), np.uint8)
PATCHES[:, :6] = (200, 60, 30)
PATCHES[:, 6:] = (20, 90, 180)
GREY = np.repeat(PATCHES[..., :1], 3, axis=2)


@pytest.mark.parametrize(
    ("encoding", "data", "expected"),
    [
        ("rgb8", PATCHES, PATCHES),
        ("bgr8", bgr_of(PATCHES), PATCHES),
        ("rgba8", np.dstack([PATCHES, PATCHES[..., :1]]), PATCHES),
        ("bgra8", np.dstack([bgr_of(PATCHES), PATCHES[..., :1]]), PATCHES),
        ("mono8", PATCHES[..., 0], GREY),
        ("mono16", PATCHES[..., 0].astype(np.uint16) * 257, GREY),
        ("rgb16", PATCHES.astype(np.uint16) * 257, PATCHES),
    ],
)
@pytest.mark.parametrize("padding", [0, 6])
def test_every_encoding_becomes_rgb(tmp_path, encoding, data, expected, padding):
    message = image(data, encoding, 10**9, padding=padding)
    path = record(tmp_path / "bag", {"/image": (IMAGE, [(10**9, message)])})
    source = open_source(str(path))
    (frame,) = source.frames()
    source.close()
    assert np.array_equal(frame.image_rgb, expected)


def test_a_bayer_mosaic_gets_its_colours_back(tmp_path):
    """A field of one colour seen through each of the four patterns, read row by row."""
    red, green, blue = 200, 100, 40
    for pattern in ("rggb", "bggr", "gbrg", "grbg"):
        tile = np.array([{"r": red, "g": green, "b": blue}[each] for each in pattern], np.uint8)
        mosaic = np.tile(tile.reshape(2, 2), (8, 8))
        message = image(mosaic, f"bayer_{pattern}8", 10**9)
        path = record(tmp_path / pattern, {"/image": (IMAGE, [(10**9, message)])})
        source = open_source(str(path))
        (frame,) = source.frames()
        source.close()
        assert np.array_equal(frame.image_rgb[4, 4], (red, green, blue)), pattern


def test_compressed_images_are_decoded(tmp_path):
    messages = []
    for number, stamp_ns in enumerate(stamps(3)):
        _, data = cv2.imencode(".jpg", numbered(number))
        messages.append((stamp_ns, TYPES[COMPRESSED](header(stamp_ns), "jpeg", data.reshape(-1))))
    messages[1][1].data = messages[1][1].data[:40]
    path = record(tmp_path / "bag", {"/front/image_raw/compressed": (COMPRESSED, messages)})
    source = open_source(str(path))
    frames = list(source.frames())
    source.close()
    assert [frame.image_rgb is None for frame in frames] == [False, True, False]
    assert "message 1" in frames[1].problem
    assert number_of(frames[2].image_rgb) == 2


def test_one_of_several_topics_has_to_be_chosen(tmp_path):
    messages = {name: [(10**9, image(numbered(k), "rgb8", 10**9))] for k, name in enumerate("ab")}
    topics = {f"/{name}/image": (IMAGE, each) for name, each in messages.items()}
    path = record(tmp_path / "bag", topics)
    with pytest.raises(
        AwarenavError, match=r"several image topics: choose --topic /a/image \| /b/image"
    ):
        open_source(str(path))
    with pytest.raises(AwarenavError, match="--topic must be one of"):
        open_source(str(path), topic="/c")
    source = open_source(str(path), topic="/b/image")
    assert [number_of(frame.image_rgb) for frame in source.frames()] == [1]
    source.close()


def test_recordings_without_images_and_other_files_are_refused(tmp_path):
    path = record(tmp_path / "bag", {"/camera_info": (INFO, [(10**9, camera_info(10**9))])})
    with pytest.raises(AwarenavError, match="no topic of type"):
        open_source(str(path))
    for name in ("broken.db3", "broken.mcap"):
        (tmp_path / name).write_bytes(b"not a recording at all, however long it is read")
        with pytest.raises(AwarenavError, match="cannot read the recording"):
            open_source(str(tmp_path / name))


def test_an_image_with_too_few_bytes_is_a_frame_with_a_problem(tmp_path):
    short = image(numbered(0), "rgb8", 10**9)
    short.data = short.data[:100]
    odd = image(numbered(0), "16SC1", 10**9)
    path = record(tmp_path / "bag", {"/image": (IMAGE, [(10**9, short), (10**9 + 1, odd)])})
    source = open_source(str(path))
    first, second = source.frames()
    source.close()
    assert "need 230400 bytes" in first.problem
    assert "got 100 bytes" in first.problem
    assert "encoding must be one of" in second.problem
