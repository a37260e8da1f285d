"""Types of the samples in a shard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

#: Side of a head crop at the head's distance.
HEAD_SIDE_M: Final = 0.40

Array = NDArray[np.float32]


@dataclass(frozen=True)
class PersonTruth:
    """A person in an image; pixels are those of the whole image (pixel centres are integers).

    Attributes:
        box_xyxy_px: (4,) of the visible pixels, from the image's corner, maxima exclusive.
        keypoints_px: (17, 2).
        keypoints_root_m: (17, 3) in camera axes, relative to the middle of the hips.
        visible: (17,).
        rotation_camera_head: (3, 3).
        head_centre_camera_m: (3,).
        head_keypoints_camera_m: (5, 3).
        head_seen: visible share of the head.
        pixels: number of pixels that show this person.
        depth_m: depth of the head's centre.
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
class ImageSample:
    """A whole image (PNG) and the people in it."""

    png: bytes
    people: tuple[PersonTruth, ...]
    focal_px: float


@dataclass(frozen=True)
class Patch:
    """A part of an image (PNG) that shows a person.

    Attributes:
        png: the part.
        origin_px: first column and row of the part in the whole image.
        size_px: width and height of the whole image.
        intrinsics_px: fx (= fy), cx, cy.
        person: the truth about the person.
    """

    png: bytes
    origin_px: tuple[int, int]
    size_px: tuple[int, int]
    intrinsics_px: tuple[float, float, float]
    person: PersonTruth


def picture(png: bytes) -> NDArray[np.uint8]:
    """Return the image (H, W, 3), RGB."""
    bgr = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    return np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[..., ::-1])
