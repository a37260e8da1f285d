"""Meeting points of a segment and triangles, one by one: faster tests are held against them."""

from __future__ import annotations

import numpy as np

# Against seams between neighbours.
_SEAM = 1e-9


def shares_met(corners_m: np.ndarray, start_m: np.ndarray, along_m: np.ndarray) -> np.ndarray:
    """Return the shares of a line's length at which it meets triangles (T, 3, 3) from either side.

    By Möller and Trumbore's test (1997). Shares below 0 lie before the start, above 1 past the end.
    """
    first, second = corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0]
    across, off = np.cross(along_m, second), start_m - corners_m[:, 0]
    turned = np.cross(off, first)
    volume = (first * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = (off * across).sum(axis=1) / volume, turned @ along_m / volume
        share = (second * turned).sum(axis=1) / volume
        met = (u >= -_SEAM) & (v >= -_SEAM) & (u + v <= 1.0 + _SEAM)
    return np.asarray(share[met & np.isfinite(share)])
