"""Covariances of place and velocity, x, y, vx, vy, as plain numbers, and as they are later."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol, TypeAlias, TypeVar

import numpy as np

from perception.arrays import FloatArray

_Value = TypeVar("_Value", float, FloatArray)
#: The upper triangle of a covariance of x, y, vx, vy, row by row.
Upper: TypeAlias = tuple[
    _Value, _Value, _Value, _Value, _Value, _Value, _Value, _Value, _Value, _Value
]

# Where each element of the covariance is in its upper triangle.
_PLACES: Final = np.array([[0, 1, 2, 3], [1, 4, 5, 6], [2, 5, 7, 8], [3, 6, 8, 9]])


class Tracked(Protocol):
    """Something with the covariance of a :class:`~tracking.PersonTrack`."""

    @property
    def covariance_odom(self) -> FloatArray:
        """(4, 4), order x, y, vx, vy."""
        ...


def drifted(upper: Upper[_Value], dt_s: _Value) -> Upper[_Value]:
    """Return F P Fᵀ: a covariance after ``dt_s`` at constant velocity; numbers, or arrays of them.

    It has no process noise. Tracker, prediction and navigation all move a track on with it.
    """
    xx, xy, xu, xv, yy, yu, yv, uu, uv, vv = upper
    return (
        xx + dt_s * (2.0 * xu + dt_s * uu),
        xy + dt_s * (yu + xv + dt_s * uv),
        xu + dt_s * uu,
        xv + dt_s * uv,
        yy + dt_s * (2.0 * yv + dt_s * vv),
        yu + dt_s * uv,
        yv + dt_s * vv,
        uu,
        uv,
        vv,
    )


def matrices(uppers: Sequence[Upper[float]]) -> FloatArray:
    """Return the covariances (N, 4, 4) of N upper triangles, N ≥ 1."""
    return np.array(uppers)[:, _PLACES]


def covariance_ahead(track: Tracked, ahead_s: float) -> Upper[float]:
    """Return the upper triangle of a track's covariance, ``ahead_s`` ≥ 0 after its stamp.

    It is that of constant velocity, without noise: xx, xy, xu, xv, yy, yu, yv, uu, uv, vv of the
    place x, y and the velocity u, v. Plain numbers, fast for one track; :func:`matrices` makes
    arrays (N, 4, 4) of them.
    """
    (xx, xy, xu, xv), (_, yy, yu, yv), (_, _, uu, uv), (_, _, _, vv) = (
        track.covariance_odom.tolist()
    )
    return drifted((xx, xy, xu, xv, yy, yu, yv, uu, uv, vv), ahead_s)
