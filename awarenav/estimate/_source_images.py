"""An image file, or a folder of image files, as a source of frames."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Final

from perception import Camera
from perception.arrays import FloatArray, finite_number, rigid_transform

from ..errors import AwarenavError
from ..records import read_records
from ._images import IMAGE_SUFFIXES, read_image, read_turned_image
from ._source import SourceFrame

_CAMERA: Final = "camera.yaml"
_TRUTH: Final = "truth.jsonl"
_RENDER: Final = "render.yaml"
# Images of `awarenav render` that are not frames.
_NOT_FRAMES: Final = ("contact_sheet.png",)


class ImageFiles:
    """One image file, or all image files of a folder in the order of the numbers in their names.

    ``camera.yaml`` beside them is their camera. ``truth.jsonl`` beside them gives the stamp and the
    camera pose of each image; what it says about people is not read. Without it, the stamps are 0,
    1, 2 … times ``interval_s``. If ``render.yaml`` is there as well, as ``awarenav render`` leaves
    it, the images in ``truth.jsonl`` are renders.

    Args:
        path: of the file or folder.
        interval_s: time between images without stamps, seconds.

    Raises:
        AwarenavError: if there is no image, or the files beside the images cannot be read.
    """

    def __init__(self, path: Path, interval_s: float = 1.0) -> None:
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
        self._interval_s = interval_s
        self._known = _stamps_and_poses(folder / _TRUTH)
        self._calibration = folder / _CAMERA
        self.rectified = False
        self.notes: tuple[str, ...] = ()
        self.count: int | None = len(self._files)
        self.rate_hz: float | None = None
        self.live = False
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
            stamp_s, pose = self._known.get(path.name, (index * self._interval_s, None))
            try:
                image, turned = read_turned_image(path)
                yield SourceFrame(path.name, stamp_s, image, pose, orientation=turned)
            except AwarenavError as error:
                yield SourceFrame(path.name, stamp_s, None, pose, str(error))

    def close(self) -> None:
        """Do nothing: no file is held open."""


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
