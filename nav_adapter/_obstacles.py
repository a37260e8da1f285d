"""The obstacles of all people."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np
import shapely

from perception.arrays import FloatArray

from ._constraints import PersonObstacle, trusted_obstacle
from ._people import Person

_SIDES: Final = 24
_ANGLES = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
# Scaled so that the sides, not the corners, touch the circle: the polygon contains it.
_UNIT_POLYGON = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1) / math.cos(math.pi / _SIDES)


def obstacles_of(people: Mapping[int, Person], now: float) -> tuple[PersonObstacle, ...]:
    """Return one obstacle per person, in the order of ``people``."""
    if not people:
        return ()
    centers = np.array([m.position_odom_m for m in people.values()])
    # The rows become the obstacles' read-only centres.
    centers.setflags(write=False)
    covariances = _covariances_at(people, now)
    # Huge numbers may have overflowed to infinity: the checking constructor refuses those.
    all_finite = math.isfinite(sum(sum(m.position_odom_m) + m.radius_m for m in people.values()))
    obstacles = []
    for (track_id, memory), center, covariance in zip(
        people.items(), centers, covariances, strict=True
    ):
        values = (
            track_id,
            center,
            memory.track.velocity_odom_mps,
            memory.radius_m,
            memory.track.height_m,
            memory.awareness_lower,
        )
        outline = partial(_polygon, memory.radius_m, center)
        obstacles.append(
            trusted_obstacle(*values, outline, covariance)
            if all_finite
            else PersonObstacle(*values, outline(), covariance)
        )
    return tuple(obstacles)


def _polygon(radius_m: float, center: FloatArray) -> shapely.Polygon:
    """Return the polygon of an obstacle at ``center`` (2,)."""
    return shapely.polygons(center + radius_m * _UNIT_POLYGON)


def _covariances_at(people: Mapping[int, Person], now: float) -> FloatArray:
    """Return the covariances (N, 4, 4) of all tracks, predicted to ``now``; read-only."""
    covariances = np.array([m.track.covariance_odom for m in people.values()])
    ages_s = [max(now - m.track.stamp_s, 0.0) for m in people.values()]
    if any(ages_s):
        dt_s = np.array(ages_s)[:, None, None]
        # F P Fᵀ by blocks, F = [[I, dt I], [0, I]].
        covariances[:, :2] += dt_s * covariances[:, 2:]
        covariances[:, :, :2] += dt_s * covariances[:, :, 2:]
    covariances.setflags(write=False)
    return covariances
