"""Depth images beside the pictures of a source: which file belongs to which frame."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from perception.depth_image import checked_depth
from perception.errors import DepthImageError

from ..errors import AwarenavError, counted
from ._pictures import decode_upright, read_image
from ._sources import ImageFiles, ImageSource, natural_order, surely_has

_SUFFIXES: Final = (".png", ".npy", ".tif", ".tiff")


class DepthFiles:
    """The depth image of each frame of a source.

    Args:
        path: for one image a file; for images a folder with a file of the same stem for each. For
            a video or a recording a folder: names that are whole numbers are numbers of frames,
            which count from 0; other names are taken in their order, one for each frame.
        source: of the frames.
        limit: most frames to use; None for all.

    Raises:
        AwarenavError: for files that are missing, too many or not depth images, and for a first one
            that does not fit its image; the message names the file.
    """

    def __init__(self, path: Path, source: ImageSource, limit: int | None = None) -> None:
        self._path, self._by_number = path, not isinstance(source, ImageFiles)
        if source.live:
            raise AwarenavError("--depth is for files; a camera or stream has no depth images")
        if isinstance(source, ImageFiles):
            used = source.files[:limit]
            self._files = _by_stem(path, source.files, used)
            _check(self._files[used[0].stem], read_image(used[0]).shape[:2])
        else:
            self._files = _numbered(path, source.count, limit)
            first = self._files[min(self._files, key=int)]
            _check(first, None)

    def of(self, frame: str) -> tuple[Path, Any]:
        """Return the file and the depth image of a frame, (H, W) metres or uint16 millimetres.

        Raises:
            AwarenavError: for a file that is missing or cannot be read.
        """
        key = str(int(frame)) if self._by_number else Path(frame).stem
        if key not in self._files:
            raise AwarenavError(f"{self._path} has no depth image of frame {frame}")
        return self._files[key], read_depth(self._files[key])


def read_depth(path: Path) -> Any:
    """Return the array in a depth file, a PNG or TIFF or a NumPy ``.npy``, in its own unit.

    An EXIF orientation is applied, as to pictures.

    Raises:
        AwarenavError: for a file that cannot be read.
    """
    try:
        if path.suffix.lower() == ".npy":
            # Mapped first: a wrong header then asks for no memory.
            return np.array(np.load(path, mmap_mode="r", allow_pickle=False))
        data = path.read_bytes()
        image = decode_upright(data)[0] if data else None
    except OSError as cause:
        raise AwarenavError(f"cannot read {path}: {cause.strerror or cause}") from cause
    except (ValueError, EOFError, cv2.error) as cause:
        raise AwarenavError(f"{path} is not a depth image that can be read: {cause}") from cause
    if image is None:
        raise AwarenavError(f"{path} is not a depth image that can be read: damaged or empty")
    return image


def _check(path: Path, shape: tuple[int, ...] | None) -> None:
    """Refuse a depth image of another shape, type or unit."""
    depth = read_depth(path)
    size = tuple(depth.shape[:2]) if shape is None else shape
    try:
        checked_depth(depth, (size[0], size[1]) if len(size) == 2 else (0, 0), 0.0, None)
    except DepthImageError as cause:
        raise AwarenavError(f"{path}: {cause}") from cause


def _by_stem(path: Path, images: tuple[Path, ...], used: Iterable[Path]) -> dict[str, Path]:
    """Return the depth image of each picture, by its stem."""
    if path.is_file():
        if len(images) > 1:
            raise AwarenavError(f"--depth must be a folder for {len(images)} images, got {path}")
        if path.suffix.lower() not in _SUFFIXES:
            raise AwarenavError(
                f"a depth image must be a file of {', '.join(_SUFFIXES)}, got {path}"
            )
        return {images[0].stem: path}
    files = {each.stem: each for each in _depth_files(path)}
    for image in used:
        if image.stem not in files:
            raise AwarenavError(
                f"{path} has no depth image of {image.name}: there must be a file {image.stem} "
                f"with one of the suffixes {', '.join(_SUFFIXES)}"
            )
    return files


def _numbered(path: Path, count: int | None, limit: int | None) -> dict[str, Path]:
    """Return the depth images of a video by the number of the frame."""
    found = _depth_files(path)
    if not all(each.stem.isdecimal() for each in found):
        if count is None or len(found) != count:
            frames = "an unknown number of frames" if count is None else counted(count, "frame")
            raise AwarenavError(
                f"{path} has {counted(len(found), 'depth image')} for {frames}; give one for "
                "each, or name them by the numbers of their frames, from 0"
            )
        return {str(number): file for number, file in enumerate(found)}
    files: dict[str, Path] = {}
    for file in found:
        number = str(int(file.stem))
        if number in files:
            raise AwarenavError(f"{files[number]} and {file} are of the same frame")
        files[number] = file
    if count is not None:
        for index in range(count if limit is None else min(count, limit)):
            if str(index) not in files and surely_has(index, count):
                raise AwarenavError(
                    f"{path} has no depth image of frame {index}, as {index:06d}.png; frames count "
                    "from 0"
                )
    return files


def _depth_files(path: Path) -> list[Path]:
    """Return the depth images of a folder in the order of the numbers in their names."""
    if not path.is_dir():
        what = "there is none" if not path.exists() else "it is a file"
        raise AwarenavError(f"--depth must be a folder of depth images, got {path}: {what}")
    files = [
        each
        for each in path.iterdir()
        if each.suffix.lower() in _SUFFIXES and not each.name.startswith(".")
    ]
    if not files:
        raise AwarenavError(f"{path} has no depth image ({', '.join(_SUFFIXES)})")
    by_stem: dict[str, Path] = {}
    for file in sorted(files):
        if file.stem in by_stem:
            raise AwarenavError(f"{by_stem[file.stem]} and {file} are of the same image")
        by_stem[file.stem] = file
    return sorted(files, key=natural_order)
