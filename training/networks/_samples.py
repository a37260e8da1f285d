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
        outline_px: (32, 2) the visible pixels' outermost points in 32 directions, from the image's
            corner. The box of a picture that is turned or sheared follows from them.
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
    outline_px: Array


@dataclass(frozen=True)
class ImageSample:
    """A whole image (PNG with the foreground as its alpha) and the people in it."""

    png: bytes
    people: tuple[PersonTruth, ...]
    focal_px: float


@dataclass(frozen=True)
class Patch:
    """A part of an image (PNG) that shows a person.

    Attributes:
        png: the part, with the foreground as its alpha.
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


#: Number of directions of an outline.
DIRECTIONS: Final = 32


def outline(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the outermost points (32, 2) of a mask's pixels in 32 directions.

    They count from the image's corner. The first direction is along the columns, so the mask's own
    box follows exactly; the box of a turned mask is right to 0.2 % of its size.
    """
    rows, columns = np.nonzero(mask)
    pixels = np.stack([columns, rows], axis=1).astype(np.int32)
    hull = np.asarray(cv2.convexHull(pixels)).reshape(-1, 2).astype(np.float64)
    corners = (hull[:, None] + [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]).reshape(-1, 2)
    angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    reach = corners @ np.stack([np.cos(angles), np.sin(angles)])
    return np.asarray(corners[reach.argmax(axis=0)])


def packed(rgb: NDArray[np.uint8], foreground: NDArray[np.bool_]) -> bytes:
    """Return an image (H, W, 3) as PNG, with the foreground (H, W) as its alpha."""
    bgra = np.dstack([rgb[..., ::-1], np.where(foreground, 255, 0).astype(np.uint8)])
    good, data = cv2.imencode(".png", bgra, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    if not good:
        raise RuntimeError("an image could not be encoded as PNG")
    return bytes(data)


def picture(png: bytes) -> NDArray[np.uint8]:
    """Return the image (H, W, 3), RGB."""
    return np.ascontiguousarray(layered_picture(png)[..., :3])


def layered_picture(png: bytes) -> NDArray[np.uint8]:
    """Return the image (H, W, 4): RGB, and 255 where the foreground is, people and things."""
    bgra = np.asarray(cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED), np.uint8)
    return np.ascontiguousarray(bgra[..., [2, 1, 0, 3]])
