"""The obstacles of all people."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from perception.arrays import FloatArray

from ._constraints import PersonObstacle
from ._people import Person


def obstacles_of(people: Collection[Person], now: float) -> tuple[PersonObstacle, ...]:
    """Return one obstacle per person, in the order of ``people``."""
    if not people:
        return ()
    centers = np.array([person.position_odom_m for person in people])
    # The rows become the obstacles' read-only centres.
    centers.setflags(write=False)
    obstacles = []
    for person, center, covariance in zip(
        people, centers, _covariances_at(people, now), strict=True
    ):
        # The adapter's own numbers need no checks, which take four times as long as the rest.
        obstacle = object.__new__(PersonObstacle)
        obstacle.__dict__.update(
            track_id=person.id,
            center_odom_m=center,
            velocity_odom_mps=person.track.velocity_odom_mps,
            radius_m=person.radius_m,
            height_m=person.track.height_m,
            awareness_lower=person.awareness_lower,
            covariance_odom=covariance,
        )
        obstacles.append(obstacle)
    return tuple(obstacles)


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
