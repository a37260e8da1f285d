"""Sources of frames: images, folders, videos, cameras and streams."""

from __future__ import annotations

import math
import re
import struct
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO, Final

import cv2

from perception import Camera
from perception.arrays import FloatArray, ImageRgb, finite_number, rigid_transform

from ..errors import AwarenavError, counted
from ..records import read_records
from ._pictures import IMAGE_SUFFIXES, UPRIGHT, as_rgb, read_image, read_turned_image

_CAMERA: Final = "camera.yaml"
_TRUTH: Final = "truth.jsonl"
_RENDER: Final = "render.yaml"
# Images of `awarenav render` that are not frames.
_NOT_FRAMES: Final = ("contact_sheet.png",)
# Lists of frames have some that cannot be decoded: so many may be missing.
_MISCOUNTED_FRAMES: Final = 2
_MISCOUNTED_SHARE: Final = 0.01
# EXIF's numbers for the turns, in degrees, that OpenCV has made as a video file asks for.
_ORIENTATIONS: Final = {90: 6, 180: 3, 270: 8}

# First boxes of MP4 and its kin (ISO/IEC 14496-12), the containers that list their frames.
_BOXES: Final = (b"ftyp", b"moov", b"mdat", b"moof", b"wide", b"free", b"skip", b"styp")
_EBML, _SEGMENT = 0x1A45DFA3, 0x18538067
# Lengths that a recorder leaves in a file which it writes to a pipe, or does not finish.
_OPEN: Final = (0, 0xFFFFFFFF)


@dataclass(frozen=True, slots=True, eq=False)
class SourceFrame:
    """A frame of a source.

    Attributes:
        name: of the frame in the results: the name of a file, or a number.
        stamp_s: time of the image.
        image_rgb: (H, W, 3) uint8; None if it could not be read.
        T_odom_camera: (4, 4) pose of the camera; None if the source does not know it.
        problem: why there is no image.
        orientation: EXIF's number of the turn that the file asked for and the image has got; 1 for
            none.
        focal_px: focal length of the image by its EXIF data; None if they do not say it.
        on_robot: whether a robot that drives has measured the pose; else it is exact.
    """

    name: str
    stamp_s: float
    image_rgb: ImageRgb | None
    T_odom_camera: FloatArray | None = None
    problem: str = ""
    orientation: int = 1
    focal_px: float | None = None
    on_robot: bool = False


class ImageSource(ABC):
    """A sequence of frames, with what the source knows about the camera.

    Attributes:
        rectified: whether the images are rectified: P of a calibration counts, without distortion.
        notes: what is wrong with the frame of the images.
        count: number of frames, if known; the number that a video states may be wrong.
        rate_hz: frames per second, if the source has a rate.
        live: whether frames come in real time; a frame that is not taken in time is lost.
        rendered: whether all frames are renders of this package.
        up_camera: (3,) direction up in the camera frame; None if the source does not know it.
        untimed: whether the stamps are mere numbers, since nothing tells the times.
    """

    rectified = False
    notes: tuple[str, ...] = ()
    count: int | None = None
    rate_hz: float | None = None
    live = False
    rendered = False
    up_camera: FloatArray | None = None
    untimed = False

    @property
    def camera(self) -> Camera | None:
        """The calibration, if the source has one.

        Raises:
            AwarenavError: for a calibration that cannot be used.
        """
        return None

    @abstractmethod
    def frames(self) -> Iterator[SourceFrame]:
        """Yield the frames; one that cannot be read has a ``problem`` and no image.

        If a source ends too early, its last frame is one with a ``problem``.
        """

    def close(self) -> None:  # noqa: B027 - not every source holds something open
        """Release the device or file."""


class ImageFiles(ImageSource):
    """One image file, or all image files of a folder in the order of the numbers in their names.

    ``camera.yaml`` beside them is their camera. ``truth.jsonl`` beside them gives the stamp and the
    camera pose of each image; what it says about people is not read. Without it, the stamps are 0,
    1, 2 … s, or as ``fps`` says. If ``render.yaml`` is there as well, as ``awarenav render`` leaves
    it, the images in ``truth.jsonl`` are renders.

    Args:
        path: of the file or folder.
        fps: images per second of a folder; None if it is not known.

    Raises:
        AwarenavError: if there is no image, or the files beside the images cannot be read.
    """

    def __init__(self, path: Path, fps: float | None = None) -> None:
        folder = path if path.is_dir() else path.parent
        if path.is_dir():
            files = [
                each
                for each in path.iterdir()
                if each.suffix.lower() in IMAGE_SUFFIXES
                and each.name not in _NOT_FRAMES
                and not each.name.startswith(".")
            ]
            if not files:
                raise AwarenavError(f"{path} has no image ({', '.join(IMAGE_SUFFIXES)})")
        else:
            files = [path]
        self._files = sorted(files, key=natural_order)
        self._known = _stamps_and_poses(folder / _TRUTH)
        self._period_s = 1.0 if fps is None else 1.0 / fps
        self.rate_hz = fps
        if fps is not None and (self._known or not path.is_dir()):
            why = f"{_TRUTH} beside it has the times" if self._known else "it is one image"
            raise AwarenavError(f"--fps is for a folder of images without times; {path}: {why}")
        self._calibration = folder / _CAMERA
        self.count = len(self._files)
        if self.count > 1 and fps is None and not self._known:
            self.untimed = True
        self.rendered = (folder / _RENDER).exists() and all(
            each.name in self._known for each in self._files
        )

    @cached_property
    def camera(self) -> Camera | None:
        """The camera of ``camera.yaml``, for images of the first one's size; None without it."""
        if not self._calibration.exists():
            return None
        try:
            height_px, width_px = read_image(self._files[0]).shape[:2]
        except AwarenavError:  # told with the frame
            return Camera.from_yaml(self._calibration)
        return Camera.from_yaml(self._calibration, image_size_px=(width_px, height_px))

    @property
    def files(self) -> tuple[Path, ...]:
        """The image files in their order."""
        return tuple(self._files)

    def frames(self) -> Iterator[SourceFrame]:
        """Yield every image; one that cannot be read has a ``problem``."""
        for index, path in enumerate(self._files):
            stamp_s, pose = self._known.get(path.name, (index * self._period_s, None))
            try:
                image, turned, focal_px = read_turned_image(path)
                yield SourceFrame(
                    path.name, stamp_s, image, pose, orientation=turned, focal_px=focal_px
                )
            except AwarenavError as error:
                yield SourceFrame(path.name, stamp_s, None, pose, str(error))


def natural_order(path: Path) -> tuple[tuple[tuple[int, int | str], ...], str]:
    """Return a sort key that counts numbers in a name as numbers: image9 before image10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((0, int(part)) if part.isdecimal() else (1, part) for part in parts), path.name


def _stamps_and_poses(truth: Path) -> dict[str, tuple[float, FloatArray | None]]:
    """Return stamp and camera pose of each frame of a rendered set, by its name."""
    if not truth.exists():
        return {}
    known = {}
    for record in read_records(truth):
        where = f"{truth}, frame {record['frame']!r}"
        pose = record["T_odom_camera"]
        known[str(record["frame"])] = (
            finite_number(f"{where}: stamp_s", record["stamp_s"], AwarenavError),
            None
            if pose is None
            else rigid_transform(f"{where}: T_odom_camera", pose, AwarenavError),
        )
    return known


class VideoSource(ImageSource):
    """Frames of a ``cv2.VideoCapture``: a file, a camera or a stream.

    The stamps of a file are those of its frames, also at a variable rate; those of a live source
    are the time since it was opened.

    Args:
        name: of the source, for messages.
        capture: the opened capture.
        live: whether it is a camera or a stream, which ends only if something is wrong.

    Raises:
        AwarenavError: if the capture is not open.
    """

    def __init__(self, name: str, capture: cv2.VideoCapture, *, live: bool) -> None:
        if not capture.isOpened():
            if not live:
                what = f"{name} as a video: it is none, damaged, or of a format that OpenCV lacks"
            elif "://" in name:
                what = f"stream {name}: is its address right, and does it send?"
            else:
                what = f"camera {name}: is it plugged in, not in use, and its number right?"
            raise AwarenavError(f"cannot open {what}")
        self._name = name
        self._capture = capture
        self.live = live
        count = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        stated = not live and 0 < count < 1e9 and _lists_frames(Path(name))
        self.count = int(count) if stated else None
        rate = capture.get(cv2.CAP_PROP_FPS)
        turn_deg = 0 if live else int(capture.get(cv2.CAP_PROP_ORIENTATION_META)) % 360
        self._orientation = _ORIENTATIONS.get(turn_deg, UPRIGHT)
        self.rate_hz = rate if math.isfinite(rate) and 0.1 <= rate <= 1000.0 else None

    def frames(self) -> Iterator[SourceFrame]:
        """Yield frames numbered from 000000; after an early end, a frame with a ``problem``."""
        period_s = 1.0 / (self.rate_hz or 30.0)
        start_s, last_s, number = time.monotonic(), -math.inf, 0
        while True:
            good, image = self._capture.read()
            if not good or image is None:
                break
            if self.live:
                stamp_s = time.monotonic() - start_s
            else:
                stamp_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
            # Containers without stamps give 0 for every frame; then only the rate is known.
            if not math.isfinite(stamp_s) or stamp_s <= last_s:
                stamp_s = 0.0 if number == 0 else last_s + period_s
            last_s = stamp_s
            name = f"{number:06d}"
            try:
                picture = as_rgb(image, f"{self._name}, frame {name}")
                yield SourceFrame(name, stamp_s, picture, orientation=self._orientation)
            except AwarenavError as error:
                yield SourceFrame(name, stamp_s, None, None, str(error))
            number += 1
        problem = self._early_end(number)
        if problem:
            yield SourceFrame(f"{number:06d}", max(last_s, 0.0), None, None, problem)

    def close(self) -> None:
        """Release the device or file."""
        self._capture.release()

    def _early_end(self, read: int) -> str:
        """Return why the source ended too early after ``read`` frames; empty if it did not."""
        if self.live:
            return f"{self._name} stopped delivering after {counted(read, 'frame')} (unplugged?)"
        if read == 0:
            return f"{self._name} has no frame that can be decoded"
        if self.count is None:
            lost = _missing_bytes(Path(self._name))
            what = f"{self._name} ends after {counted(read, 'frame')}: it is cut off"
            return f"{what}, {lost} bytes are missing" if lost else ""
        if not surely_has(read, self.count):
            return ""
        frames = counted(self.count, "frame")
        return f"{self._name} ends after {read} of {frames}: it is cut off or damaged"


def open_video(what: str | int, *, live: bool) -> VideoSource:
    """Open a file, a stream or a camera without OpenCV's own messages on standard error."""
    logging = cv2.utils.logging
    level = logging.getLogLevel()
    logging.setLogLevel(logging.LOG_LEVEL_SILENT)
    try:
        return VideoSource(str(what), cv2.VideoCapture(what), live=live)
    finally:
        logging.setLogLevel(level)


def surely_has(index: int, count: int) -> bool:
    """Return whether a video that states a number of frames has one of this index, from 0."""
    return index < count - max(_MISCOUNTED_FRAMES, int(_MISCOUNTED_SHARE * count)) or index == 0


def _lists_frames(path: Path) -> bool:
    """Return whether a container has a list of its frames.

    Others (Matroska, WebM, AVI, MPEG-TS, FLV, …) have no number of frames, or count empty ones. A
    number of their frames is the duration times a nominal rate.
    """
    with path.open("rb") as file:
        return file.read(8)[4:] in _BOXES


def _missing_bytes(path: Path) -> int:
    """Return how many bytes a cut-off Matroska, WebM or AVI file lacks; 0 if it does not say."""
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(0)
            end = _riff_end(file, size) if file.read(4) == b"RIFF" else _matroska_end(file)
    except (OSError, struct.error, IndexError):  # gone, or cut off in its head
        return 0
    return max(end - size, 0)


def _riff_end(file: BinaryIO, size: int) -> int:
    """Return where the last RIFF chunk ends; long AVI files have several."""
    at = 0
    while at < size:
        file.seek(at)
        kind, length = struct.unpack("<4sI", file.read(8))
        if kind != b"RIFF" or length in _OPEN:
            return 0
        at += 8 + length + length % 2
    return at


def _matroska_end(file: BinaryIO) -> int:
    """Return where the segment ends (RFC 8794 and RFC 9559); 0 if that is unknown."""
    file.seek(0)
    for wanted in (_EBML, _SEGMENT):
        if int.from_bytes(file.read(4), "big") != wanted:
            return 0
        first = file.read(1)[0]
        more = 8 - first.bit_length()
        rest = file.read(more)
        length = int.from_bytes(bytes([first & (0x7F >> more)]) + rest, "big")
        if length == (1 << 7 * (more + 1)) - 1:
            return 0
        if wanted == _SEGMENT:
            return file.tell() + length
        file.seek(length, 1)
    return 0
