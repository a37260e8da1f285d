"""From pixels and depths to a skeleton in metres, by the lengths of its limbs."""

from __future__ import annotations

from typing import Final

import numpy as np

from .. import layouts as kp
from .._metric_scale import DEFAULT_MIN_SCORE
from ..anthropometry import LIMBS
from ..arrays import FloatArray

_BODY: Final = 17
# Of limbs that are seen flat, those that point at the camera look short and ask for too large a
# scale; the quarter that asks for the smallest lies in the plane of the image.
_FLAT_QUANTILE: Final = 0.25
_MEDIAN: Final = 0.5


def _ends() -> tuple[FloatArray, FloatArray]:
    """End minus start of each limb, and which keypoints it needs, (limbs, 17) both."""
    difference = np.zeros((len(LIMBS), _BODY))
    for row, limb in enumerate(LIMBS):
        difference[row, list(limb.end)] += 1.0 / len(limb.end)
        difference[row, list(limb.start)] -= 1.0 / len(limb.start)
    return difference, (difference != 0.0).astype(np.float64)


_DIFFERENCE, _NEEDED = _ends()
_LENGTHS_M: Final = np.array([limb.length_m for limb in LIMBS])
_WEIGHTS: Final = np.array([limb.relative_std**-2 for limb in LIMBS])


def metres_per_pixel(
    keypoints_px: FloatArray, depths_m: FloatArray | None, scores: FloatArray
) -> FloatArray:
    """Scale (N,) of bodies that are much farther away than they are deep.

    Each limb votes for the scale that makes it as long as an adult's, given its extent in depth,
    with a weight that falls as it turns towards the camera; the weighted median wins. Where depths
    are not known a low quantile takes its place. Limbs that are seen at both ends vote; where
    there are none, all do. 0 where every limb has no extent.

    Args:
        keypoints_px: (N, K, 2).
        depths_m: (N, K) relative to the mid-hip, or None.
        scores: (N, K).
    """
    ends_px = _DIFFERENCE @ keypoints_px[:, :_BODY]
    extent_px = np.hypot(ends_px[..., 0], ends_px[..., 1])
    depth = 0.0 if depths_m is None else depths_m[:, :_BODY] @ _DIFFERENCE.T
    across = np.maximum(_LENGTHS_M**2 - np.square(depth), 0.0) * np.ones_like(extent_px)
    weight = _WEIGHTS * across / _LENGTHS_M**2 * (extent_px > 1e-9)
    hidden = (scores[:, :_BODY] < DEFAULT_MIN_SCORE).astype(np.float64) @ _NEEDED.T > 0.0
    seen = weight * ~hidden
    weight = np.where(seen.any(axis=1, keepdims=True), seen, weight)
    votes = np.sqrt(across) / np.maximum(extent_px, 1e-9)
    order = np.argsort(votes, axis=1)
    total = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
    quantile = _FLAT_QUANTILE if depths_m is None else _MEDIAN
    # The first vote at which the share is reached; strictly above zero, so that it has weight.
    chosen = np.argmax((total >= quantile * total[:, -1:]) & (total > 0.0), axis=1)
    scale = votes[np.arange(len(votes)), order[np.arange(len(votes)), chosen]]
    return np.asarray(np.where(total[:, -1] > 0.0, scale, 0.0))


def lift(keypoints_px: FloatArray, depths_m: FloatArray | None, scores: FloatArray) -> FloatArray:
    """Skeletons (N, K, 3) in camera axes relative to the mid-hip, in metres.

    Pixels are scaled about the mid-hip (weak perspective); depths stay as they are. Without depths
    the skeleton is flat: every z is 0, and limbs are hardly ever longer than the true ones.

    Args:
        keypoints_px: (N, K, 2).
        depths_m: (N, K) relative to the mid-hip, or None.
        scores: (N, K).
    """
    scale = metres_per_pixel(keypoints_px, depths_m, scores)
    hips = 0.5 * (keypoints_px[:, kp.LEFT_HIP] + keypoints_px[:, kp.RIGHT_HIP])
    skeleton = np.zeros((*keypoints_px.shape[:2], 3))
    skeleton[..., :2] = (keypoints_px - hips[:, None]) * scale[:, None, None]
    if depths_m is not None:
        skeleton[..., 2] = depths_m
    return skeleton
