"""Places and velocities of tracks: how certain they are, and what no person can have."""

from __future__ import annotations

import math
from typing import Final

from perception.matrices import larger_eigenvalue
from tracking import PersonTrack

from ._errors import NavError

# Positions, speeds and standard deviations beyond these are errors of whoever sent them. Beyond
# 1e15 m a circle's corners fall together.
_MOST_M: Final = 1e12
_MOST_MPS: Final = 1e4
_MOST: Final = (
    ("position_odom_m", _MOST_M, "m"),
    ("velocity_odom_mps", _MOST_MPS, "m/s"),
    ("the standard deviation of covariance_odom", _MOST_M, "m"),
    ("the velocity's variance in covariance_odom", _MOST_MPS**2, "m²/s²"),
)


def position_sigma_m(track: PersonTrack, ahead_s: float) -> float:
    """Return the standard deviation of the position after ``ahead_s`` ≥ 0 at constant velocity.

    It is that of the most uncertain direction: the root of the larger eigenvalue of the position's
    part of F P Fᵀ.
    """
    (xx, xy, xu, xv), (_, yy, yu, yv), (_, _, uu, uv), (_, _, _, vv) = (
        track.covariance_odom.tolist()
    )
    xx += ahead_s * (2.0 * xu + ahead_s * uu)
    yy += ahead_s * (2.0 * yv + ahead_s * vv)
    xy += ahead_s * (xv + yu + ahead_s * uv)
    return math.sqrt(max(larger_eigenvalue(xx, xy, yy), 0.0))


def velocity_variance_m2ps2(track: PersonTrack) -> float:
    """Return the variance of the velocity along its most uncertain direction."""
    _, _, (_, _, uu, uv), (_, _, _, vv) = track.covariance_odom.tolist()
    variance_m2ps2: float = larger_eigenvalue(uu, uv, vv)
    return variance_m2ps2


def refuse_absurd(
    track: PersonTrack,
    place_m: tuple[float, float],
    velocity_mps: tuple[float, float],
    sigma_m: float,
) -> None:
    """Refuse a person whose finite numbers are too large for any person.

    Args:
        track: of the person.
        place_m: predicted place, in odom.
        velocity_mps: of the track.
        sigma_m: standard deviation of the place.

    Raises:
        NavError: for such a number, or NaN, which an overflow may leave.
    """
    numbers = (
        max(abs(place_m[0]), abs(place_m[1])),
        max(abs(velocity_mps[0]), abs(velocity_mps[1])),
        sigma_m,
        velocity_variance_m2ps2(track),
    )
    if sum(numbers) <= _MOST_MPS:
        return
    for value, (name, most, unit) in zip(numbers, _MOST, strict=True):
        if not value <= most:
            raise NavError(
                f"track {track.id}: {name} must be at most {most:g} {unit}, got {value:g}"
            )
