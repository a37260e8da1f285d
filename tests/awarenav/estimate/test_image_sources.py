"""Sources of frames: files, folders, videos and cameras; and the threads that read them."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from numbered_images import number_of, numbered

from awarenav.errors import AwarenavError
from awarenav.estimate import SourceFrame, open_source
from awarenav.estimate._pictures import as_rgb, read_image
from awarenav.estimate._run import FramePrefetcher
from awarenav.estimate._sources import ImageFiles, VideoSource
from awarenav.video import VideoWriter
from perception import Camera

RED = np.zeros((4, 6, 3), np.uint8)
RED[..., 0], RED[..., 1] = 200, 16


def save(path: Path, image: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), image)
    return path


def film(path: Path, count: int, rate_hz: int = 12) -> Path:
    with VideoWriter(path, rate_hz, (64, 48)) as video:
        for number in range(count):
            video.add(numbered(number, (64, 48)))
    return path


@pytest.mark.parametrize(
    ("image", "expected"),
    [
        (RED[..., ::-1], RED),
        (np.dstack([RED[..., ::-1], np.zeros((4, 6), np.uint8)]), RED),
        (RED[..., 0], np.repeat(RED[..., :1], 3, axis=2)),
        (RED[..., ::-1].astype(np.uint16) * 257, RED),
    ],
    ids=["colour", "transparent", "grey", "16 bits"],
)
def test_every_kind_of_image_becomes_rgb(tmp_path, image, expected):
    assert np.array_equal(read_image(save(tmp_path / "a.png", image)), expected)


@pytest.mark.parametrize(
    "array",
    [np.zeros((4, 4), np.float32), np.zeros((4, 4, 2), np.uint8), np.zeros((0, 4), np.uint8)],
)
def test_arrays_that_are_not_images_are_refused(array):
    with pytest.raises(AwarenavError, match="8 or 16 bits, got"):
        as_rgb(array, "it")


@pytest.mark.parametrize("data", [b"", b"not an image", b"\x89PNG\r\n\x1a\n"])
def test_files_that_are_not_images_are_refused_by_name(tmp_path, data):
    path = tmp_path / "a.png"
    path.write_bytes(data)
    with pytest.raises(AwarenavError, match=r"a\.png"):
        read_image(path)


def test_a_folder_is_read_in_the_order_of_its_numbers(tmp_path):
    for number in (10, 9, 1):
        save(tmp_path / f"shot{number}.png", numbered(number))
    save(tmp_path / "contact_sheet.png", numbered(0))
    (tmp_path / "notes.txt").write_text("not an image")
    source = ImageFiles(tmp_path)
    frames = list(source.frames())
    assert [frame.name for frame in frames] == ["shot1.png", "shot9.png", "shot10.png"]
    assert [number_of(frame.image_rgb) for frame in frames] == [1, 9, 10]
    assert [frame.stamp_s for frame in frames] == [0.0, 1.0, 2.0]
    assert source.count == 3
    assert source.camera is None
    # Digits that are no decimals of ASCII may stand in a name.
    (tmp_path / "more").mkdir()
    names = [name for digit in "²৪Ⅷ" for name in (f"5{digit}6.png", f"{digit}.png")]
    for name in names:
        save(tmp_path / "more" / name, numbered(3))
    frames = list(ImageFiles(tmp_path / "more").frames())
    assert sorted(frame.name for frame in frames) == sorted(names)
    assert all(number_of(frame.image_rgb) == 3 for frame in frames)


def test_a_rendered_set_gives_stamps_poses_and_camera_but_not_people(tmp_path):
    camera = Camera.from_fov(64, 48, 1.0)
    camera.to_yaml(tmp_path / "camera.yaml")
    save(tmp_path / "000000.png", numbered(0))
    pose = np.eye(4)
    pose[2, 3] = 1.4
    record = {"frame": "000000.png", "stamp_s": 7.5, "T_odom_camera": pose.tolist()}
    (tmp_path / "truth.jsonl").write_text(json.dumps({**record, "people": "not for us"}) + "\n")
    source = ImageFiles(tmp_path)
    (frame,) = source.frames()
    assert frame.stamp_s == 7.5
    assert np.array_equal(frame.T_odom_camera, pose)
    assert np.array_equal(source.camera.matrix, camera.matrix)


def test_a_video_has_the_stamps_of_its_frames(tmp_path):
    source = open_source(str(film(tmp_path / "a.mp4", 12)))
    frames = list(source.frames())
    source.close()
    assert source.count == 12
    assert source.rate_hz == pytest.approx(12.0)
    assert [frame.stamp_s for frame in frames] == pytest.approx(
        [k / 12 for k in range(12)], abs=2e-3
    )
    assert [number_of(frame.image_rgb) for frame in frames] == list(range(12))
    assert all(not frame.problem for frame in frames)


def cut_film(tmp_path: Path) -> Path:
    """A video whose index comes first and whose frames end early, in the middle of one."""
    import av  # noqa: PLC0415

    rng = np.random.default_rng(0)
    path = tmp_path / "whole.mp4"
    with av.open(str(path), "w", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.options = {"g": "1", "bf": "0"}
        for _ in range(40):
            noise = rng.integers(0, 255, (48, 64, 3)).astype(np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(noise, format="rgb24")))
        container.mux(stream.encode())
    data = path.read_bytes()
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(data[: len(data) * 6 // 10])
    return cut


def test_a_video_that_ends_in_the_middle_of_a_frame_keeps_what_came_before(tmp_path):
    source = open_source(str(cut_film(tmp_path)))
    *frames, last = source.frames()
    source.close()
    assert 15 <= len(frames) <= 30
    assert all(frame.image_rgb is not None for frame in frames)
    assert last.image_rgb is None
    assert f"ends after {len(frames)} of 40 frames" in last.problem


def test_a_camera_that_is_unplugged_is_a_problem_after_its_last_frame(tmp_path):
    capture = cv2.VideoCapture(str(film(tmp_path / "a.mp4", 5)))
    source = VideoSource("0", capture, live=True)
    *frames, last = source.frames()
    source.close()
    assert len(frames) == 5
    assert source.count is None
    stamps = [frame.stamp_s for frame in frames]
    assert stamps == sorted(set(stamps))
    assert "unplugged" in last.problem


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("absent.mp4", r"no such file.*did you mean .*absent\.mov"),
        ("absent.mov", "as a video: it is none"),
        ("photo.HEIC", "HEIF picture, which cannot be read: save it as JPEG"),
        ("empty", "has no image"),
        ("99", "cannot open camera"),
        ("²", "no such file or folder: .*²"),
        ("9" * 30, "no such file or folder"),
        ("9" * 5000, "cannot read .*: File name too long|no such file"),
    ],
)
def test_sources_that_cannot_be_opened_are_refused(tmp_path, name, message):
    (tmp_path / "absent.mov").write_bytes(b"no video")
    (tmp_path / "photo.HEIC").write_bytes(b"a picture of a telephone")
    (tmp_path / "empty").mkdir()
    with pytest.raises(AwarenavError, match=message):
        open_source(name if name.isdigit() else str(tmp_path / name))


class Counting:
    """A source of numbered images that may wait for a sign, or fail."""

    camera = rate_hz = None
    rendered = False

    def __init__(self, count, *, live=False, error=None):
        self.count = count
        self.live = live
        self.made = 0
        self.go_on = threading.Event()
        self._error = error

    def frames(self):
        for number in range(self.count):
            self.made += 1
            yield SourceFrame(str(number), float(number), numbered(number % 30))
        self.go_on.set()
        if self._error is not None:
            raise self._error


def test_prefetching_keeps_the_order_stays_a_few_frames_ahead_and_stops_when_closed():
    for limit, count in ((None, 50), (2, 2)):
        with FramePrefetcher(Counting(50), limit) as frames:
            assert [frame.name for frame in frames] == [str(number) for number in range(count)]
    source = Counting(1000)
    with FramePrefetcher(source) as frames:
        next(iter(frames))
    assert source.made < 20


def test_an_error_of_the_source_is_raised_after_the_frames_before_it():
    source = Counting(3, error=AwarenavError("the cable"))
    names = []
    with pytest.raises(AwarenavError, match="the cable"), FramePrefetcher(source) as frames:
        names.extend(frame.name for frame in frames)
    assert names == ["0", "1", "2"]


def test_a_live_source_gives_its_newest_frame():
    source = Counting(100, live=True)
    with FramePrefetcher(source) as frames:
        assert source.go_on.wait(10.0)
        assert [frame.name for frame in frames][-1] == "99"
