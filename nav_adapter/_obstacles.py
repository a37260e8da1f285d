"""The obstacles of all people."""

from __future__ import annotations

import math
from collections.abc import Collection
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


def obstacles_of(people: Collection[Person], now: float) -> tuple[PersonObstacle, ...]:
    """Return one obstacle per person, in the order of ``people``."""
    if not people:
        return ()
    centers = np.array([person.position_odom_m for person in people])
    # The rows become the obstacles' read-only centres.
    centers.setflags(write=False)
    return tuple(
        trusted_obstacle(
            partial(_polygon, person.radius_m, center),
            person.id,
            center,
            person.track.velocity_odom_mps,
            person.radius_m,
            person.track.height_m,
            person.awareness_lower,
            covariance,
        )
        for person, center, covariance in zip(
            people, centers, _covariances_at(people, now), strict=True
        )
    )


def _polygon(radius_m: float, center: FloatArray) -> shapely.Polygon:
    """Return the polygon of an obstacle at ``center`` (2,)."""
    return shapely.polygons(center + radius_m * _UNIT_POLYGON)


def _covariances_at(people: Collection[Person], now: float) -> FloatArray:
    """Return the covariances (N, 4, 4) of all tracks, predicted to ``now``; read-only."""
    covariances = np.array([person.track.covariance_odom for person in people])
    ages_s = [max(now - person.track.stamp_s, 0.0) for person in people]
    if any(ages_s):
        dt_s = np.array(ages_s)[:, None, None]
        # F P Fᵀ by blocks, F = [[I, dt I], [0, I]].
        covariances[:, :2] += dt_s * covariances[:, 2:]
        covariances[:, :, :2] += dt_s * covariances[:, :, 2:]
    covariances.setflags(write=False)
    return covariances
