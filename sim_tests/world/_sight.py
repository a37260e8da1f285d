"""Straight lines on the floor plane, and the boxes in their way.

Lines of sight: what a worker sees, and which of a body's keypoints a picture shows.
"""

from __future__ import annotations

from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from .bullet import pybullet

# A line along an axis is given this much of the other direction, so that nothing is divided by 0.
_LEAST_M = 1e-9


def crosses_boxes(boxes_odom_m: FloatArray, start_m: Any, ends_m: Any) -> NDArray[np.bool_]:
    """Whether the lines from ``start_m`` (2,) to ``ends_m`` (K, 2) cross a box, (K,), by slabs.

    Args:
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
        start_m: (2,).
        ends_m: (K, 2).
    """
    origin = np.asarray(start_m, dtype=np.float64)
    along = np.asarray(ends_m, dtype=np.float64).reshape(-1, 2) - origin
    safe = np.where(np.abs(along) < _LEAST_M, _LEAST_M, along)[:, None]
    first = (boxes_odom_m[:, :2] - origin) / safe
    second = (boxes_odom_m[:, 2:] - origin) / safe
    enter = np.minimum(first, second).max(axis=2)
    leave = np.maximum(first, second).min(axis=2)
    return np.asarray(((enter < leave) & (leave > 0.0) & (enter < 1.0)).any(axis=1))


# A line of sight starts outside the head.
_SKULL_M: Final = 0.16
#: A keypoint counts as seen when nothing lies in front of it by more than this: joint centres lie
#: inside the body, the points of the face on its skin.
JOINT_DEPTH_M: Final = 0.16
FACE_DEPTH_M: Final = 0.04
#: The first keypoints are those of the face.
FACE_KEYPOINTS: Final = 5
_NEAR_M: Final = 0.1


class Beholder(Protocol):
    """Somebody with eyes and a body in a physics world."""

    body: int
    client: int

    @property
    def eyes_odom_m(self) -> FloatArray:
        """(3,) midpoint of the eyes."""
        ...


def sees(
    beholder: Beholder, target_odom_m: FloatArray, through: frozenset[int] = frozenset()
) -> bool:
    """True unless something stands between the eyes and a point.

    Args:
        beholder: whose eyes.
        target_odom_m: (3,).
        through: bodies that do not count, such as the robot whose camera the target is.
    """
    eyes = beholder.eyes_odom_m
    ray = target_odom_m - eyes
    distance = float(np.linalg.norm(ray))
    if distance <= _SKULL_M:
        return True
    start = eyes + ray * (_SKULL_M / distance)
    (hit,) = pybullet.rayTestBatch(
        [start.tolist()], [target_odom_m.tolist()], physicsClientId=beholder.client
    )
    return hit[0] == -1 or hit[0] == beholder.body or hit[0] in through


def keypoints_in_front(
    points_camera_m: FloatArray, pixels_px: FloatArray, depth_m: FloatArray
) -> NDArray[np.bool_]:
    """Which keypoints (K, 3), projected to (K, 2), a picture with this depth (H, W) shows."""
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
