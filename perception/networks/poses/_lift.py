"""Lifting: from keypoints in pixels, and their depths if known, to a skeleton in metres."""

from __future__ import annotations

from typing import Final

import numpy as np

from ... import layouts as kp
from ...anthropometry import LIMBS
from ...arrays import FloatArray
from ...body import DEFAULT_MIN_SCORE, LIMB_DIFFERENCE, LIMB_KEYPOINTS

# Quantile of the votes that counts without depths. A limb that points at the camera looks short
# and votes for too large a scale; the quarter with the smallest votes lies across the view.
_FLAT_QUANTILE: Final = 0.25
_MEDIAN: Final = 0.5
_SQUARED_LENGTH_M2: Final = np.array([limb.length_m**2 for limb in LIMBS])
# To be multiplied by the squared length of the limb across the view.
_WEIGHTS: Final = np.array([limb.relative_std**-2 for limb in LIMBS]) / _SQUARED_LENGTH_M2


def metres_per_pixel(
    keypoints_px: FloatArray,
    depths_m: FloatArray | None,
    scores: FloatArray,
    limb_scale: float = 1.0,
) -> FloatArray:
    """Return the scale (N,) of bodies whose distance is much larger than their depth.

    Each limb votes for the scale at which it is as long as an average adult's, given its extent in
    depth. The weight of the vote falls as the limb turns towards the camera. The result is the
    weighted median, or without depths a low quantile. Limbs with both ends seen vote; without such
    limbs all vote. The scale is 0 if every limb has length 0.

    Args:
        keypoints_px: (N, K, 2).
        depths_m: (N, K) depths relative to the mid-hip, or None.
        scores: (N, K).
        limb_scale: limb lengths between the keypoints of this network, relative to
            :data:`perception.anthropometry.LIMBS`.
    """
    ends_px = LIMB_DIFFERENCE @ keypoints_px[:, kp.BODY]
    extent_px = np.sqrt((ends_px * ends_px).sum(axis=2))
    depth = np.zeros_like(extent_px)
    if depths_m is not None:
        depth = depths_m[:, kp.BODY] @ LIMB_DIFFERENCE.T
    across = np.maximum(limb_scale**2 * _SQUARED_LENGTH_M2 - depth * depth, 0.0)
    weight = _WEIGHTS * across * (extent_px > 1e-9)
    seen = (scores[:, kp.BODY] < DEFAULT_MIN_SCORE) @ LIMB_KEYPOINTS == 0.0
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
    """Return the weighted quantile of the votes of seen limbs, or of all limbs if none is seen."""
    valid = [entry for entry in zip(votes, weights, seen, strict=True) if entry[1] > 0.0]
    pairs = sorted(
        [(vote, weight) for vote, weight, is_seen in valid if is_seen]
        or [(vote, weight) for vote, weight, _ in valid]
    )
    total = 0.0
    threshold = quantile * sum(weight for _, weight in pairs)
    for vote, weight in pairs:
        total += weight
        if total >= threshold:
            return vote
    return pairs[-1][0] if pairs else 0.0


def lift_keypoints(
    keypoints_px: FloatArray,
    depths_m: FloatArray | None,
    scores: FloatArray,
    limb_scale: float = 1.0,
) -> FloatArray:
    """Return skeletons (N, K, 3) in metres, in camera axes, relative to the mid-hip.

    Pixels are scaled about the mid-hip (weak perspective); depths are copied. Without depths the
    skeleton is flat: every z is 0, and limbs are rarely longer than the true ones.

    Args:
        keypoints_px: (N, K, 2).
        depths_m: (N, K) depths relative to the mid-hip, or None.
        scores: (N, K).
        limb_scale: as in :func:`metres_per_pixel`.
    """
    scale = metres_per_pixel(keypoints_px, depths_m, scores, limb_scale)
    hips = 0.5 * (keypoints_px[:, kp.LEFT_HIP] + keypoints_px[:, kp.RIGHT_HIP])
    skeleton = np.zeros((*keypoints_px.shape[:2], 3))
    skeleton[..., :2] = (keypoints_px - hips[:, None]) * scale[:, None, None]
    if depths_m is not None:
        skeleton[..., 2] = depths_m
    return skeleton
