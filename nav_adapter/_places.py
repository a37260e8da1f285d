"""Places and velocities of tracks: how certain they are, and what no person can have."""

from __future__ import annotations

from typing import Final

from tracking import PersonTrack

from ._errors import NavError
from .reach import Spread

# Positions, speeds and standard deviations beyond these are errors of whoever sent them. Beyond
# 1e15 m a circle's corners fall together.
_MOST_M: Final = 1e12
_MOST_MPS: Final = 1e4


def position_sigma_m(track: PersonTrack, ahead_s: float) -> float:
    """Return the standard deviation of the position after ``ahead_s`` ≥ 0 at constant velocity.

    It is that of the most uncertain direction.
    """
    return Spread.of(track.covariance_odom.tolist()).after(ahead_s).sigma_m


def checked_sigma_m(
    track: PersonTrack,
    place_m: tuple[float, float],
    velocity_mps: tuple[float, float],
    ahead_s: float,
) -> float:
    """Return :func:`position_sigma_m` of a person whose numbers are not too large for any person.

    The place is predicted, in odom, and the velocity is that of the track.

    Raises:
        NavError: for such a number.
    """
    rows = track.covariance_odom.tolist()
    place, speed = max(map(abs, place_m)), max(map(abs, velocity_mps))
    sigma_m = Spread.of(rows).after(ahead_s).sigma_m
    variance = max(rows[2][2], rows[3][3])
    for name, value, most, unit in (
        ("position_odom_m", place, _MOST_M, "m"),
        ("velocity_odom_mps", speed, _MOST_MPS, "m/s"),
        ("the standard deviation of covariance_odom", sigma_m, _MOST_M, "m"),
        ("the velocity's variance in covariance_odom", variance, _MOST_MPS**2, "m²/s²"),
    ):
        # A NaN, which an overflow may leave, fails the comparison too.
        if not value <= most:
            raise NavError(
                f"track {track.id}: {name} must be at most {most:g} {unit}, got {value:g}"
            )
    return sigma_m
