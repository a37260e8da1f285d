"""The obstacles of all people: circles, and polygons that may be longer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np
import shapely

from perception.arrays import FloatArray
from tracking.prediction import PredictionModel

from ._constraints import PersonObstacle, trusted_obstacle
from ._memory import PersonMemory, position_sigma_m
from ._policy import AwarenessPolicy
from ._predicted import predicted_sigmas_m

_SIDES: Final = 24
_ANGLES = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
# Scaled so that the sides, not the corners, touch the circle: the polygon contains it.
_UNIT_POLYGON = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1) / math.cos(math.pi / _SIDES)
# Time between the discs of the sweep; the convex hull joins them with straight lines.
_SWEEP_STEP_S: Final = 0.25


def obstacles_of(
    people: Mapping[int, PersonMemory],
    now: float,
    policy: AwarenessPolicy,
    prediction: PredictionModel | None = None,
) -> tuple[PersonObstacle, ...]:
    """Return one obstacle per person, in the order of ``people``.

    The prediction gives the width of the sweep; without one, the policy's outline does.
    """
    if not people:
        return ()
    centers = np.array([m.position_odom_m for m in people.values()])
    # The rows become the obstacles' read-only centres.
    centers.setflags(write=False)
    covariances = _covariances_at(people, now)
    # Huge numbers may have overflowed to infinity: the checking constructor refuses those.
    all_finite = math.isfinite(float(centers.sum()) + sum(m.radius_m for m in people.values()))
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
        outline = partial(_polygon, memory, center, now, policy, prediction)
        obstacles.append(
            trusted_obstacle(*values, outline, covariance)
            if all_finite
            else PersonObstacle(*values, outline(), covariance)
        )
    return tuple(obstacles)


def _polygon(
    memory: PersonMemory,
    center: FloatArray,
    now: float,
    policy: AwarenessPolicy,
    prediction: PredictionModel | None,
) -> shapely.Polygon:
    """Return the polygon of an obstacle at ``center`` (2,)."""
    ring = center + memory.radius_m * _UNIT_POLYGON
    if policy.outline.unaware_ahead_s > 0.0 or policy.outline.sweep_s > 0.0:
        points = np.concatenate([ring, *_discs_ahead(memory, center, now, policy, prediction)])
        return shapely.convex_hull(shapely.multipoints(points))
    return shapely.polygons(ring)


def _covariances_at(people: Mapping[int, PersonMemory], now: float) -> FloatArray:
    """Return the covariances (N, 4, 4) of all tracks, predicted to ``now``; read-only."""
    covariances = np.array([m.track.covariance_odom for m in people.values()])
    dt_s = np.array([max(now - m.track.stamp_s, 0.0) for m in people.values()])[:, None, None]
    if dt_s.any():
        # F P Fᵀ by blocks, F = [[I, dt I], [0, I]].
        covariances[:, :2] += dt_s * covariances[:, 2:]
        covariances[:, :, :2] += dt_s * covariances[:, :, 2:]
    covariances.setflags(write=False)
    return covariances


def _discs_ahead(
    memory: PersonMemory,
    center: FloatArray,
    now: float,
    policy: AwarenessPolicy,
    prediction: PredictionModel | None,
) -> list[FloatArray]:
    """Return polygons around the disc at the end of the elongation and the discs of the sweep."""
    outline, margins = policy.outline, policy.margins
    tip = center + memory.ahead_m * np.array(memory.direction_odom)
    discs = [tip + memory.radius_m * _UNIT_POLYGON]
    steps = math.ceil(outline.sweep_s / _SWEEP_STEP_S)
    for step in range(1, steps + 1):
        ahead_s = outline.sweep_s * step / steps
        if prediction is None:
            sigma_m = _sigma_ahead_m(memory, now, ahead_s, policy)
        else:
            horizon_s = np.array([max(now + ahead_s - memory.track.stamp_s, 0.0)])
            sigma_m = float(predicted_sigmas_m(memory.track, horizon_s, prediction)[0])
        wider_m = margins.uncertainty_sigmas * max(0.0, sigma_m - memory.sigma_m)
        radius_m = margins.bounded_m(memory.radius_m + wider_m)
        predicted = center + ahead_s * memory.track.velocity_odom_mps
        discs.append(predicted + radius_m * _UNIT_POLYGON)
    return discs


def _sigma_ahead_m(
    memory: PersonMemory, now: float, ahead_s: float, policy: AwarenessPolicy
) -> float:
    """Return the standard deviation of the position predicted ``ahead_s`` from now.

    It is that of the most uncertain direction. White acceleration of density q adds q t³/3 to the
    variance, and the sum is multiplied to make up for the overconfidence of constant velocity.
    """
    outline = policy.outline
    predicted_m = position_sigma_m(memory.track, now + ahead_s)
    noise_m2 = outline.acceleration_density_m2ps3 * ahead_s**3 / 3.0
    return math.sqrt((predicted_m**2 + noise_m2) * (1.0 + outline.overconfidence_per_s * ahead_s))
