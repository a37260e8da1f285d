"""Pictures are read upright, as their EXIF orientation says, and never with a wrong calibration."""

from __future__ import annotations

import io
import math
import struct
import zlib
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest
from numbered_images import CAMERA, HEIGHT, WIDTH, NumberReader, numbered
from PIL import Image
from test_estimate import estimate

from awarenav import AwarenavError
from awarenav.estimate import CameraChoice, open_source
from awarenav.estimate._pictures import read_image
from awarenav.records import read_records
from awarenav.video import VideoWriter
from perception import Camera

SHAPE = (48, 64, 3)
TURN = Image.Transpose
#: The turn that a camera has made, by the orientation that it writes.
STORED = {
    1: None,
    2: TURN.FLIP_LEFT_RIGHT,
    3: TURN.ROTATE_180,
    4: TURN.FLIP_TOP_BOTTOM,
    5: TURN.TRANSPOSE,
    6: TURN.ROTATE_90,
    7: TURN.TRANSVERSE,
    8: TURN.ROTATE_270,
}


def scene() -> np.ndarray:
    """Return a picture of which no turn looks like another."""
    image = np.full(SHAPE, 60, np.uint8)
    image[:24] = (200, 40, 40)
    image[:, :20, 2] = 220
    return image


def stored(path: Path, orientation: int, image: np.ndarray | None = None) -> Path:
    picture = Image.fromarray(scene() if image is None else image)
    turn = STORED[orientation]
    exif = Image.Exif()
    exif[0x0112] = orientation
    picture = picture if turn is None else picture.transpose(turn)
    picture.save(path, exif=exif, quality=95)
    return path


@pytest.mark.parametrize("suffix", ["jpg", "png", "webp", "tif"])
def test_a_picture_is_read_upright(tmp_path: Path, suffix: str) -> None:
    for orientation in STORED:
        read = read_image(stored(tmp_path / f"a.{suffix}", orientation))
        assert read.shape == SHAPE
        assert np.abs(read.astype(float) - scene()).mean() < 6.0


@pytest.mark.parametrize("kind", ["H", "I"])  # a short number as the standard wants, or a long one
@pytest.mark.parametrize("fill", [b"", b"\xff\xff"])
def test_an_orientation_is_found_behind_other_blocks_and_in_either_byte_order(
    tmp_path, kind: str, fill: bytes
) -> None:
    upside_down = np.ascontiguousarray(scene()[::-1, ::-1, ::-1])
    jpeg = cv2.imencode(".jpg", upside_down, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes()
    other = b"http://ns.adobe.com/xap/1.0/\0<x/>"
    for order, mark in (("<", b"II*\0"), (">", b"MM\0*")):
        entries = struct.pack(order + "HHIHH", 0x010F, 3, 1, 7, 0)
        number = struct.pack(order + kind, 3).ljust(4, b"\0")
        entries += struct.pack(order + "HHI", 0x0112, 3 if kind == "H" else 4, 1) + number
        block = b"Exif\0\0" + mark + struct.pack(order + "IH", 8, 2) + entries + bytes(4)
        segments = b"".join(
            fill + b"\xff\xe1" + struct.pack(">H", len(each) + 2) + each for each in (other, block)
        )
        path = tmp_path / "a.jpg"
        path.write_bytes(jpeg[:2] + segments + jpeg[2:])
        assert np.abs(read_image(path).astype(float) - scene()).mean() < 6.0


@pytest.mark.parametrize("cut", [14, 20, 26, 30, 38])
def test_damaged_exif_data_leave_the_picture_as_it_is_stored(tmp_path: Path, cut: int) -> None:
    buffer = io.BytesIO()
    exif = Image.Exif()
    exif[0x0112] = 3
    Image.fromarray(scene()).save(buffer, "png")
    block = exif.tobytes().removeprefix(b"Exif\0\0")[: cut - 12]
    png = buffer.getvalue()
    chunk = struct.pack(">I4s", len(block), b"eXIf") + block
    chunk += struct.pack(">I", zlib.crc32(chunk[4:]))
    (tmp_path / "a.png").write_bytes(png[:33] + chunk + png[33:])
    read = read_image(tmp_path / "a.png")
    assert np.array_equal(read, scene()) or np.array_equal(read, scene()[::-1, ::-1])


def turned_folder(path: Path, orientation: int, camera: Camera | None) -> Path:
    path.mkdir()
    if camera is not None:
        camera.to_yaml(path / "camera.yaml")
    for number in range(2):
        stored(path / f"{number:06d}.png", orientation, numbered(number))
    return path


@pytest.mark.parametrize("orientation", [3, 6])
def test_a_calibration_that_may_be_for_the_pixels_as_stored_is_refused(tmp_path, orientation):
    sensor = CAMERA if orientation <= 4 else Camera.from_fov(HEIGHT, WIDTH, 1.0)
    source = turned_folder(tmp_path / "set", orientation, sensor)
    with pytest.raises(AwarenavError, match=f"EXIF orientation {orientation}.*save the pixels up"):
        estimate(NumberReader(), source, "--out", tmp_path / "a.jsonl")
    arguments = ["--out", tmp_path / "b.jsonl", "--fov-deg", 60]
    assert estimate(NumberReader(), source, *arguments) == 0
    upright = turned_folder(tmp_path / "upright", 1, None)
    assert estimate(NumberReader(), upright, "--out", tmp_path / "c.jsonl", "--fov-deg", 60) == 0
    people = [read_records(tmp_path / name)[0]["people"] for name in ("b.jsonl", "c.jsonl")]
    assert people[0] == people[1] != []


def test_the_size_of_a_quarter_turn_fits_and_depth_of_a_picture_upside_down_is_refused(
    tmp_path: Path,
) -> None:
    out = tmp_path / "a.jsonl"
    assert estimate(NumberReader(), turned_folder(tmp_path / "a", 6, CAMERA), "--out", out) == 0
    assert len(read_records(out)) == 2
    source = turned_folder(tmp_path / "set", 3, None)
    (tmp_path / "depth").mkdir()
    for number in range(2):
        depth = np.full((HEIGHT, WIDTH), 3000, np.uint16)
        assert cv2.imwrite(str(tmp_path / f"depth/{number:06d}.png"), depth)
    arguments = ["--depth", tmp_path / "depth", "--fov-deg", 60, "--out", tmp_path / "b.jsonl"]
    with pytest.raises(AwarenavError, match="depth image may be for the pixels as stored"):
        estimate(NumberReader(), source, *arguments)


def test_a_video_that_is_shown_upside_down_has_no_sure_calibration_either(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    with VideoWriter(path, 10, (WIDTH, HEIGHT)) as video:
        for number in range(3):
            video.add(np.ascontiguousarray(numbered(number)[::-1, ::-1]))
    data = bytearray(path.read_bytes())
    matrix = (-65536, 0, 0, 0, -65536, 0, WIDTH << 16, HEIGHT << 16, 1 << 30)
    at = data.index(b"tkhd") + 44
    data[at : at + 36] = struct.pack(">9i", *matrix)
    path.write_bytes(data)
    frame = next(open_source(str(path)).frames())
    assert frame.image_rgb is not None
    assert np.abs(frame.image_rgb.astype(float) - numbered(0)).mean() < 6.0
    CAMERA.to_yaml(tmp_path / "camera.yaml")
    arguments = ["--camera", tmp_path / "camera.yaml", "--out", tmp_path / "a.jsonl"]
    with pytest.raises(AwarenavError, match="the file turns the picture"):
        estimate(NumberReader(), path, *arguments)
    fov_deg = math.degrees(2.0 * math.atan(0.5 * WIDTH / CAMERA.fx_px))
    arguments = ["--fov-deg", fov_deg, "--out", tmp_path / "b.jsonl"]
    assert estimate(NumberReader(), path, *arguments) == 0


@pytest.mark.parametrize("orientation", [1, 6])
@pytest.mark.parametrize("portrait", [False, True])
def test_60_degrees_are_those_of_the_longer_side(tmp_path: Path, orientation, portrait) -> None:
    said: list[str] = []
    image = scene() if not portrait else np.ascontiguousarray(np.swapaxes(scene(), 0, 1))
    path = stored(tmp_path / "a.jpg", orientation, image)
    with closing(open_source(str(path))) as source:
        (frame,) = source.frames()
        height, width = frame.image_rgb.shape[:2]
        assert (height > width) == portrait
        camera = CameraChoice.of_options(None, None, source, said.append).of_size(width, height)
    assert camera.fx_px == camera.fy_px == pytest.approx(32.0 / math.tan(math.radians(30.0)))
    assert "60 degrees across the longer side are assumed" in said[0]


@pytest.mark.parametrize("suffix", ["jpg", "png", "webp"])
@pytest.mark.parametrize(
    ("focal_mm", "size", "used"),
    [(26, (64, 48), True), (52, (6400, 4800), True), (26, (4000, 2000), False), (0, None, False)],
)
def test_exif_s_focal_length_is_used_and_said(tmp_path, suffix, focal_mm, size, used) -> None:
    """By the diagonal, as the standard of camera makers has it; not of a picture that was cut."""
    exif, said = Image.Exif(), []
    exif[0x0112] = 6
    more = exif.get_ifd(0x8769)
    more[0xA405] = focal_mm
    if size is not None:
        more[0xA002], more[0xA003] = size
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(scene()).save(path, exif=exif)
    with closing(open_source(str(path))) as source:
        (frame,) = source.frames()
        cameras = CameraChoice.of_options(None, None, source, said.append)
        camera = cameras.of_size(48, 64, frame.focal_px)
        given = CameraChoice.of_options(None, 60.0, source, said.append)
        assert given.of_size(48, 64, frame.focal_px).fx_px == pytest.approx(41.57, abs=0.01)
    wanted = focal_mm * 80.0 / math.hypot(36.0, 24.0) if used else 32.0 / math.tan(math.pi / 6.0)
    assert camera.fx_px == pytest.approx(wanted)
    (text,) = said
    assert ("by its EXIF data" if used else "are assumed") in text.replace("are by", "by")
