"""Blur of the crop of a head, of which a network's own uncertainty says too little."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from ...arrays import FloatArray

_Grey = NDArray[np.float32]

# Crops are judged at this size, where noise and the blocks of JPEG have no detail of their own.
_SIZE: Final = 32
# The outer part of a crop shows more of the scenery than of the head.
_BORDER: Final = 4
# Mean square of the second differences, in squares of grey levels, of a crop that shows nothing.
_NO_DETAIL: Final = 0.01
# Length of a crop that shows nothing, as a share of its side.
_LONGEST: Final = 0.25
# Sharp heads have lengths up to this. Beyond it, errors of the direction grow with the length,
# compared with what the network says of them.
_SHARP: Final = 0.05


def blur_lengths(crops: Iterable[NDArray[np.uint8]]) -> FloatArray:
    """Return the length by which the detail of each crop is smeared, as a share of the crop's side.

    It is the root mean square of the picture's first derivative over that of the second, both along
    the direction in which the picture changes least. Motion blur leaves only frequencies below the
    inverse of its length along its direction, so the ratio grows with it. Brightness and contrast
    do not change it. Sharp heads have about 0.042, rendered and photographed ones alike.

    Args:
        crops: N crops (size, size, 3), RGB.

    Returns:
        (N,) lengths, at most 0.25, which a crop without any detail has.
    """
    return np.array([_blur_length(crop) for crop in crops], dtype=np.float64)


def uncertainty_factors(crops: Iterable[NDArray[np.uint8]]) -> FloatArray:
    """Return the factors (N,) ≥ 1 by which blur enlarges standard deviations of the direction."""
    return np.maximum(blur_lengths(crops) / _SHARP, 1.0)


def _blur_length(crop: NDArray[np.uint8]) -> float:
    small = cv2.resize(crop, (_SIZE, _SIZE), interpolation=cv2.INTER_AREA)
    inner = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)[_BORDER:-_BORDER, _BORDER:-_BORDER]
    across, down = _differences(inner.astype(np.float32))
    # The eigenvector of the structure tensor to its smaller eigenvalue.
    xx, xy, yy = np.vdot(across, across), np.vdot(across, down), np.vdot(down, down)
    angle = 0.5 * (math.atan2(2.0 * float(xy), float(xx - yy)) + math.pi)
    u, v = math.cos(angle), math.sin(angle)
    first = u * across + v * down
    across, down = _differences(first)
    second = u * across + v * down
    detail = float(np.vdot(second, second)) / second.size
    if detail < _NO_DETAIL:
        return _LONGEST
    change = float(np.vdot(first, first)) / first.size
    # Both differences are taken across two pixels.
    return min(2.0 / _SIZE * math.sqrt(change / detail), _LONGEST)


def _differences(picture: _Grey) -> tuple[_Grey, _Grey]:
    """Return the differences across and down of the inner pixels, over two pixels each."""
    return picture[1:-1, 2:] - picture[1:-1, :-2], picture[2:, 1:-1] - picture[:-2, 1:-1]
