"""Visibility of points: by a ray through the physics world, and in a depth image.

:mod:`sim_tests.world.sightlines` tests lines of sight against the rendered surfaces instead.
"""

from __future__ import annotations

import math
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from .bullet import pybullet

#: A keypoint counts as visible if no surface lies in front of it by more than this: joint centres
#: lie inside the body, the points of the face on its skin.
JOINT_DEPTH_M: Final = 0.16
FACE_DEPTH_M: Final = 0.04
#: The first keypoints are those of the face.
FACE_KEYPOINTS: Final = 5

# A line of sight starts at this distance from the eyes, outside the head.
_HEAD_M: Final = 0.16
# A keypoint nearer to the camera plane than this is never visible.
_NEAR_M: Final = 0.1


class Viewer(Protocol):
    """A person with eyes and a body in a physics world."""

    body: int
    client: int

    @property
    def eyes_odom_m(self) -> FloatArray:
        """The midpoint of the eyes, (3,)."""
        ...


def sees(viewer: Viewer, target_odom_m: FloatArray, through: frozenset[int] = frozenset()) -> bool:
    """Return whether nothing stands between a person's eyes and a point in the physics world."""
    first = first_body_before(viewer, target_odom_m)
    return first in (-1, viewer.body) or first in through


def first_body_before(viewer: Viewer, target_odom_m: FloatArray) -> int:
    """Return the id of the first body between a person's eyes and a point (3,); −1 for none."""
    eyes: list[float] = viewer.eyes_odom_m.tolist()
    target: list[float] = target_odom_m.tolist()
    distance = math.dist(eyes, target)
    if distance <= _HEAD_M:
        return -1
    share = _HEAD_M / distance
    start = [eye + share * (end - eye) for eye, end in zip(eyes, target, strict=True)]
    hit = pybullet.rayTest(start, target, physicsClientId=viewer.client)
    return int(hit[0][0])


def keypoints_in_front(
    points_camera_m: FloatArray, pixels_px: FloatArray, depth_m: FloatArray
) -> NDArray[np.bool_]:
    """Return (K,) whether each keypoint is visible in a depth image.

    Args:
        points_camera_m: (K, 3) in the optical frame.
        pixels_px: (K, 2) their projections; NaN behind the camera.
        depth_m: (H, W) along the optical axis.
    """
    height, width = depth_m.shape
    column, row = (np.floor(np.nan_to_num(pixels_px, nan=-9.0) + 0.5).astype(int)).T
    inside = (
        (points_camera_m[:, 2] > _NEAR_M)
        & (column >= 0)
        & (column < width)
        & (row >= 0)
        & (row < height)
    )
    front = depth_m[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
    tolerance = np.full(len(points_camera_m), JOINT_DEPTH_M)
    tolerance[:FACE_KEYPOINTS] = FACE_DEPTH_M
    visible: Any = inside & (points_camera_m[:, 2] <= front + tolerance)
    return np.asarray(visible)
