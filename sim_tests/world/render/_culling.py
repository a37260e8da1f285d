"""View culling: the boxes that a view cannot show are not drawn.

The tests are conservative: a box is left out only if no sample of the image can fall on it.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._view import RenderView

BoolArray = NDArray[np.bool_]

# The software renderer works in single precision: a sample may round to a box's edge.
_SLACK_SAMPLES: Final = 0.05
_SLACK_TANGENT: Final = 1e-4
_SLACK_M: Final = 1e-3
_UNIT_CORNERS: Final = np.array(
    [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
)


def box_corners(boxes_m: FloatArray) -> FloatArray:
    """Return the corners (N, 8, 3) of axis-aligned boxes (N, 2, 3), low and high corner."""
    low, high = boxes_m[:, None, 0], boxes_m[:, None, 1]
    return np.asarray(low + _UNIT_CORNERS * (high - low))


def to_camera(view: RenderView, corners_odom_m: FloatArray) -> FloatArray:
    """Return corners (N, 8, 3) in the view's optical frame."""
    rotation, origin = view.T_odom_camera[:3, :3], view.T_odom_camera[:3, 3]
    flat = corners_odom_m.reshape(-1, 3) @ rotation - origin @ rotation
    return np.asarray(flat.reshape(corners_odom_m.shape))


def in_view(view: RenderView, corners_camera_m: FloatArray) -> BoolArray:
    """Return (N,) False for a box (N, 8, 3) outside the frustum or between the samples.

    A box in front of the camera projects into the rectangle around its projected corners: if no
    sample lies in this rectangle, none falls on the box. A box that reaches behind the near plane
    is tested against the frustum's side planes only.
    """
    x, y, z = corners_camera_m[..., 0], corners_camera_m[..., 1], corners_camera_m[..., 2]
    low_z, high_z = z.min(axis=1), z.max(axis=1)
    shown: BoolArray = (high_z >= view.near_m - _SLACK_M) & (low_z <= view.far_m + _SLACK_M)
    ahead = low_z > 0.5 * view.near_m
    straddling = shown & ~ahead
    if straddling.any():
        some = x[straddling], y[straddling], z[straddling]
        shown[straddling] = _between_planes(view, *some)
    rows = np.flatnonzero(shown & ahead)
    depth = z[rows]
    for along, edge, far_edge, samples in (
        (x[rows], view.left, view.right, view.width),
        (y[rows], view.top, view.bottom, view.height),
    ):
        scale = samples / (far_edge - edge)
        samples_at = (along / depth - edge) * scale - 0.5  # sample i lies at i
        first = np.ceil(samples_at.min(axis=1) - _SLACK_SAMPLES)
        last = np.floor(samples_at.max(axis=1) + _SLACK_SAMPLES)
        shown[rows] &= np.maximum(first, 0.0) <= np.minimum(last, samples - 1.0)
    return shown


def _between_planes(view: RenderView, x: FloatArray, y: FloatArray, z: FloatArray) -> BoolArray:
    """Return (N,) False for boxes with all corners (N, 8) beyond one side plane."""
    slack = _SLACK_TANGENT * np.abs(z) + _SLACK_M
    return np.asarray(
        (x - view.left * z > -slack).any(axis=1)
        & (x - view.right * z < slack).any(axis=1)
        & (y - view.top * z > -slack).any(axis=1)
        & (y - view.bottom * z < slack).any(axis=1)
    )
