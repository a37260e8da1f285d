"""Reading SimCC outputs: keypoints as peaks along one axis at a time.

SimCC (Li et al., ECCV 2022) gives each keypoint one row of bins an axis, several to a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray

#: Half the depth that RTMW3D's z axis spans about the mid-hip, in metres: ``z_range`` of its codec.
Z_RANGE_M: Final = 2.1744869

_AROUND: Final = np.array([-1, 0, 1])


def peaks(axes: Sequence[NDArray[Any]]) -> tuple[FloatArray, FloatArray]:
    """Find the peak of each row, between the bins.

    A parabola through the highest bin and its neighbours refines the place: through their
    logarithms where all three are positive, which is exact for the Gaussians that such networks are
    trained on, else through the values. A row whose peak is not finite has place 0 and value 0.

    Args:
        axes: activations (N, K, bins) of each axis; the bins may differ.

    Returns:
        Places (axes, N, K) in bins, and values (axes, N, K) at the highest bin.
    """
    shape = (len(axes), *axes[0].shape[:2])
    rows = shape[1] * shape[2]
    starts, last = _rows(rows, tuple(activations.shape[2] for activations in axes))
    # Few and large NumPy calls: with 17 keypoints their number is what takes the time.
    top = np.array([activations.argmax(axis=2) for activations in axes]).reshape(-1, rows)
    around = (top + starts)[..., None] + _AROUND  # of a NaN, where there is one
    values = np.array(
        [
            activations.take(place, mode="clip")
            for activations, place in zip(axes, around, strict=True)
        ],
        dtype=np.float64,
    )
    height = values[..., 1]
    with np.errstate(all="ignore"):
        curve = np.log(values)
        if not values.min() > 0.0:
            curve = np.where(values.min(axis=2, keepdims=True) > 0.0, curve, values)
        before, middle, after = curve[..., 0], curve[..., 1], curve[..., 2]
        shift = 0.5 * (before - after) / (before - 2.0 * middle + after)
    # At either end of an axis, and where the three make no peak, the bin itself is the place.
    # Midway between two bins rounding may carry it a little past the middle.
    inner = (np.abs(shift) < 0.501) & (top > 0) & (top < last)
    place = top + np.where(inner, shift, 0.0)
    good = np.isfinite(height)
    if not good.all():
        place, height = np.where(good, place, 0.0), np.where(good, height, 0.0)
    return place.reshape(shape), height.reshape(shape)


@lru_cache(maxsize=8)
def _rows(rows: int, bins: tuple[int, ...]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where each row of each axis starts in its activations (axes, rows); last bins (axes, 1)."""
    counts = np.array(bins, dtype=np.intp)[:, None]
    return counts * np.arange(rows), counts - 1


def depth_m(places: FloatArray, bins: int, range_m: float = Z_RANGE_M) -> FloatArray:
    """Places along z in bins to metres from the mid-hip, away from the camera.

    ``z = (place / split / (depth / 2) − 1) · 2.1744869`` with depth = bins / split, so that the
    split ratio drops out.
    """
    return np.asarray((2.0 / bins * range_m) * places - range_m)


def confidence(heights: FloatArray, possible: NDArray[np.bool_]) -> FloatArray:
    """Confidence (N, K) of keypoints: that of the weakest axis, in [0, 1].

    A keypoint that the network cannot place along one axis is not placed.

    Args:
        heights: (axes, N, K).
        possible: (N, K) False where the keypoint cannot have been seen.
    """
    return np.asarray(possible * np.minimum(np.maximum(heights.min(axis=0), 0.0), 1.0))
