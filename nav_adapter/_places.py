"""Places of tracks: how certain they are, and whether two can be those of one person."""

from __future__ import annotations

import math
from typing import Final

from perception.matrices import larger_eigenvalue
from tracking import PersonTrack

from .reach import Spread

# Standard deviations by which two positions of one person may differ. 4 are exceeded once in
# 3000 frames, which costs a moment of speed.
_EXPLAINED_SIGMAS: Final = 4.0
# Places closer than this are the same, also for a tracker that reports no uncertainty.
_SAME_PLACE_M: Final = 0.05


def position_sigma_m(track: PersonTrack, ahead_s: float) -> float:
    """Return the standard deviation of the position after ``ahead_s`` ≥ 0 at constant velocity.

    It is that of the most uncertain direction.
    """
    return Spread.of(track.covariance_odom.tolist()).after(ahead_s).sigma_m


def velocity_variance_m2ps2(track: PersonTrack) -> float:
    """Return the variance of the velocity along its most uncertain direction."""
    variance_m2ps2: float = larger_eigenvalue(*Spread.of(track.covariance_odom.tolist()).velocity)
    return variance_m2ps2


def has_jumped(old: PersonTrack, track: PersonTrack, walking_mps: float) -> bool:
    """Return whether a track is where the person of an older one cannot be.

    The place is explained by the place of the older track, or by its prediction with constant
    velocity, within the covariances of both and the way walked at ``walking_mps``.
    """
    elapsed_s = max(track.stamp_s - old.stamp_s, 0.0)
    x, y = track.position_odom_m.tolist()
    (old_x, old_y), (vx, vy) = old.position_odom_m.tolist(), old.velocity_odom_mps.tolist()
    apart_m = min(
        math.hypot(x - old_x, y - old_y),
        math.hypot(x - old_x - elapsed_s * vx, y - old_y - elapsed_s * vy),
    )
    way_m = walking_mps * elapsed_s + _SAME_PLACE_M
    if apart_m <= way_m:
        return False
    sigma_m = math.hypot(position_sigma_m(old, elapsed_s), position_sigma_m(track, 0.0))
    return apart_m > way_m + _EXPLAINED_SIGMAS * sigma_m
