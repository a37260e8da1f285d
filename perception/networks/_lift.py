"""From pixels and depths to a skeleton in metres, by the lengths of its limbs."""

from __future__ import annotations

from typing import Final

import numpy as np

from .. import layouts as kp
from .._metric_scale import DEFAULT_MIN_SCORE, LIMB_DIFFERENCE, LIMB_KEYPOINTS
from ..anthropometry import LIMBS
from ..arrays import FloatArray

_BODY: Final = 17
# Of limbs that are seen flat, those that point at the camera look short and ask for too large a
# scale; the quarter that asks for the smallest lies in the plane of the image.
_FLAT_QUANTILE: Final = 0.25
_MEDIAN: Final = 0.5


_SQUARED_M2: Final = np.array([limb.length_m**2 for limb in LIMBS])
# Times the square of what is left of the length across the view.
_WEIGHTS: Final = np.array([limb.relative_std**-2 for limb in LIMBS]) / _SQUARED_M2


def metres_per_pixel(
    keypoints_px: FloatArray,
    depths_m: FloatArray | None,
    scores: FloatArray,
    limb_scale: float = 1.0,
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
        limb_scale: how long limbs are between keypoints as this network places them, relative to
            :data:`perception.anthropometry.LIMBS`.
    """
    ends_px = LIMB_DIFFERENCE @ keypoints_px[:, :_BODY]
    extent_px = np.sqrt((ends_px * ends_px).sum(axis=2))
    depth = np.zeros_like(extent_px)
    if depths_m is not None:
        depth = depths_m[:, :_BODY] @ LIMB_DIFFERENCE.T
    across = np.maximum(limb_scale**2 * _SQUARED_M2 - depth * depth, 0.0)
    weight = _WEIGHTS * across * (extent_px > 1e-9)
    seen = (scores[:, :_BODY] < DEFAULT_MIN_SCORE) @ LIMB_KEYPOINTS == 0.0
    votes = np.sqrt(across) / np.maximum(extent_px, 1e-9)
    quantile = _FLAT_QUANTILE if depths_m is None else _MEDIAN
    return np.array(
        [
            _weighted_quantile(*row, quantile)
            for row in zip(votes.tolist(), weight.tolist(), seen.tolist(), strict=True)
        ]
    )


def _weighted_quantile(
    votes: list[float], weights: list[float], seen: list[bool], quantile: float
) -> float:
    """The first of the ordered votes at which the share is reached; of those seen, if any."""
    cast = [entry for entry in zip(votes, weights, seen, strict=True) if entry[1] > 0.0]
    pairs = sorted(
        [(vote, weight) for vote, weight, there in cast if there]
        or [(vote, weight) for vote, weight, _ in cast]
    )
    total = 0.0
    share = quantile * sum(weight for _, weight in pairs)
    for vote, weight in pairs:
        total += weight
        if total >= share:
            return vote
    return pairs[-1][0] if pairs else 0.0


def lift(
    keypoints_px: FloatArray,
    depths_m: FloatArray | None,
    scores: FloatArray,
    limb_scale: float = 1.0,
) -> FloatArray:
    """Skeletons (N, K, 3) in camera axes relative to the mid-hip, in metres.

    Pixels are scaled about the mid-hip (weak perspective); depths stay as they are. Without depths
    the skeleton is flat: every z is 0, and limbs are hardly ever longer than the true ones.

    Args:
        keypoints_px: (N, K, 2).
        depths_m: (N, K) relative to the mid-hip, or None.
        scores: (N, K).
        limb_scale: see :func:`metres_per_pixel`.
    """
    scale = metres_per_pixel(keypoints_px, depths_m, scores, limb_scale)
    hips = 0.5 * (keypoints_px[:, kp.LEFT_HIP] + keypoints_px[:, kp.RIGHT_HIP])
    skeleton = np.zeros((*keypoints_px.shape[:2], 3))
    skeleton[..., :2] = (keypoints_px - hips[:, None]) * scale[:, None, None]
    if depths_m is not None:
        skeleton[..., 2] = depths_m
    return skeleton
