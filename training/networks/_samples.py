"""What a shard holds, and reading shards."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

#: What a head crop's side measures at the head's distance.
HEAD_SIDE_M: Final = 0.40

Array = NDArray[np.float32]


@dataclass(frozen=True)
class PersonTruth:
    """A person in a picture; pixels are those of the whole picture (pixel centres are integers).

    Attributes:
        box_xyxy_px: (4,) of what shows, counted from the picture's corner, maxima exclusive.
        keypoints_px: (17, 2).
        keypoints_root_m: (17, 3) in camera axes, relative to the middle of the hips.
        visible: (17,).
        rotation_camera_head: (3, 3).
        head_centre_camera_m: (3,).
        head_keypoints_camera_m: (5, 3).
        head_seen: share of the head that shows.
        pixels: number that show this person.
        depth_m: of the head's centre.
    """

    box_xyxy_px: Array
    keypoints_px: Array
    keypoints_root_m: Array
    visible: NDArray[np.bool_]
    rotation_camera_head: Array
    head_centre_camera_m: Array
    head_keypoints_camera_m: Array
    head_seen: float
    pixels: int
    depth_m: float


@dataclass(frozen=True)
class Frame:
    """A whole picture (PNG) and the people in it."""

    png: bytes
    people: tuple[PersonTruth, ...]
    focal_px: float


@dataclass(frozen=True)
class Patch:
    """A part of a picture (PNG) that shows a person.

    Attributes:
        png: the part.
        origin_px: its first column and row in the whole picture.
        size_px: width and height of the whole picture.
        intrinsics_px: fx (= fy), cx, cy.
        person: who.
    """

    png: bytes
    origin_px: tuple[int, int]
    size_px: tuple[int, int]
    intrinsics_px: tuple[float, float, float]
    person: PersonTruth


def read_shards(folder: Path, first: int = 0, last: int | None = None) -> Iterator[dict[str, Any]]:
    """The shards of a folder in order."""
    for path in sorted(folder.glob("scene*.pkl"))[first:last]:
        yield pickle.loads(path.read_bytes())


def picture(png: bytes) -> NDArray[np.uint8]:
    """(H, W, 3) RGB."""
    bgr = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    return np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])
