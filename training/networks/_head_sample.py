"""One head as training data, and crops about it, cut as in use or off centre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.networks.heads import ray_axes, ray_stretch

from ._augment import inside_of, similarity, warp

SIZE: Final = 64
_SWAP: Final = [0, 2, 1, 4, 3]
_MIRROR: Final = np.diag([-1.0, 1.0, 1.0])
# Mirroring a head swaps its right (z) and left.
_MIRROR_HEAD: Final = np.diag([1.0, 1.0, -1.0])
#: Least visible share of a head for a crop to count as showing one.
LEAST_SEEN: Final = 0.35


@dataclass
class HeadSample:
    """A head at the camera's own resolution; pixels count from the corner of ``image``.

    ``image`` is (H, W, 4), or (H, W, 3) once it is photographed. ``side_px`` is the side of a crop
    for a camera turned to the head. ``scale`` is 1 or the pixels per pixel of the camera of a large
    head that is stored smaller. ``inside`` (4, 2) are the corners of the camera's picture; None has
    none in reach.
    """

    image: NDArray[np.uint8]
    centre: NDArray[np.float64]
    side_px: float
    keypoints: NDArray[np.float64]
    visible: NDArray[np.bool_]
    focal_px: float
    principal_point: NDArray[np.float64]
    rotation_camera_head: NDArray[np.float64]
    seen: float
    scale: float = 1.0
    inside: NDArray[np.float64] | None = None


def cropped(
    head: HeadSample,
    shift: NDArray[np.float64],
    enlarged: float,
    angle: float,
    *,
    flip: bool,
    coarse: int | None = None,
) -> dict[str, Any]:
    """Return a crop about the head, off by ``shift`` of its side, with its transformed truth."""
    side = head.side_px * enlarged
    middle = head.centre + _looking_at(head, head.centre)[1] @ (shift * side)
    axes, stretch = _looking_at(head, middle)
    # As head_crop cuts it: a square for the camera that is turned to the middle.
    turn = similarity(np.zeros(2), SIZE / side, angle, (SIZE, SIZE), flip=flip)
    linear = turn[:, :2] @ np.linalg.inv(stretch)
    matrix = np.column_stack([linear, turn[:, 2] - linear @ middle])
    drawn = side * np.abs(stretch).sum(axis=1).max()
    if coarse is None:
        image = warp(head.image, matrix, (SIZE, SIZE), int(np.clip(np.ceil(drawn / SIZE), 1, 8)))
    else:
        # As from farther away: few pixels, then enlarged.
        small = max(8, round(coarse * enlarged))
        step = int(np.clip(np.ceil(drawn / small), 1, 8))
        image = warp(head.image, matrix * small / SIZE, (small, small), step)
        grow = np.array([[SIZE / small, 0.0, 0.0], [0.0, SIZE / small, 0.0]])
        image = warp(image, grow, (SIZE, SIZE))
    rotation = axes.T @ head.rotation_camera_head
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    keypoints = (head.keypoints @ matrix[:, :2].T + matrix[:, 2]) / SIZE
    visible = head.visible
    if flip:
        rotation = _MIRROR @ rotation @ _MIRROR_HEAD
        keypoints, visible = keypoints[_SWAP], visible[_SWAP]
    return {
        "image": image[..., :3],
        "rotation": rotation,
        "keypoints": keypoints,
        "visible": visible & inside_of(keypoints, np.array([0.0, 0.0, 1.0, 1.0])),
        "centre": (matrix[:, :2] @ head.centre + matrix[:, 2]) / SIZE,
        "log_side": np.log(enlarged),
        "head": float(head.seen > LEAST_SEEN),
        "weight": float(head.seen > 0.5 * LEAST_SEEN),
    }


def _looking_at(
    head: HeadSample, point: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ray axes (3, 3) and stretch (2, 2) of the lens at a point of the image."""
    axes = ray_axes((point - head.principal_point)[None] / head.focal_px)
    return axes[0], ray_stretch(axes)[0]
