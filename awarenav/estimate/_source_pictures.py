"""A picture file, or a folder of them, as a source of frames."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from perception import Camera
from perception.arrays import FloatArray, finite_number, rigid_transform

from ..errors import AwarenavError
from ..records import read_records
from ._source import PICTURE_SUFFIXES, SourceFrame, read_picture

_CAMERA: Final = "camera.yaml"
_TRUTH: Final = "truth.jsonl"
# Pictures of `awarenav render` that are none of its frames.
_NO_FRAMES: Final = ("contact_sheet.png",)


class PictureSource:
    """One picture file, or all of a folder in the order of the numbers in their names.

    ``camera.yaml`` beside them is their camera. ``truth.jsonl`` beside them tells when and from
    where each was taken; nothing that it says about people is read. Without it, pictures have the
    stamps 0, 1, 2 … times ``interval_s``.

    Args:
        path: file or folder.
        interval_s: between pictures whose stamps are not known.

    Raises:
        AwarenavError: when there is no picture, or the files beside them cannot be read.
    """

    def __init__(self, path: Path, interval_s: float = 1.0) -> None:
        folder = path if path.is_dir() else path.parent
        if path.is_dir():
            files = [
                each
                for each in path.iterdir()
                if each.suffix.lower() in PICTURE_SUFFIXES
                and each.name not in _NO_FRAMES
                and not each.name.startswith(".")
            ]
            if not files:
                raise AwarenavError(f"{path} holds no picture ({', '.join(PICTURE_SUFFIXES)})")
        else:
            files = [path]
        self._files = sorted(files, key=_in_order)
        self._interval_s = interval_s
        self._known = _stamps_and_poses(folder / _TRUTH)
        self.camera = Camera.from_yaml(folder / _CAMERA) if (folder / _CAMERA).exists() else None
        self.count: int | None = len(self._files)
        self.rate_hz: float | None = None
        self.live = False

    def frames(self) -> Iterator[SourceFrame]:
        """Yield every picture; one that cannot be read has a ``problem``."""
        for index, path in enumerate(self._files):
            stamp_s, pose = self._known.get(path.name, (index * self._interval_s, None))
            try:
                yield SourceFrame(path.name, stamp_s, read_picture(path), pose)
            except AwarenavError as error:
                yield SourceFrame(path.name, stamp_s, None, pose, str(error))

    def close(self) -> None:
        """Nothing is held."""


def _in_order(path: Path) -> tuple[tuple[tuple[int, int | str], ...], str]:
    """Numbers in a name count as numbers: picture9 comes before picture10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((0, int(part)) if part.isdigit() else (1, part) for part in parts), path.name


def _stamps_and_poses(truth: Path) -> dict[str, tuple[float, FloatArray | None]]:
    """When and from where each frame of a rendered set was taken."""
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
