"""Which measurement belongs to which track, and which of these matches are in doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from perception.arrays import FloatArray

# Stands for "not allowed": above the cost of any set of allowed matches.
_FORBIDDEN_COST = 1e6


@dataclass(frozen=True, slots=True)
class Gates:
    """When a match is possible, and when it is in doubt.

    Attributes:
        mahalanobis2: largest squared Mahalanobis distance (χ² with two degrees of freedom).
        distance_m: largest distance.
        ambiguity_margin: rivals within this cost of the chosen match put it in doubt, …
        ambiguity_distance_m: … if they are no further away than this.
    """

    mahalanobis2: float
    distance_m: float
    ambiguity_margin: float
    ambiguity_distance_m: float


@dataclass(frozen=True, slots=True)
class Match:
    """A track (row) that takes a measurement (column); ``ambiguous`` when it could be another's."""

    track: int
    measurement: int
    ambiguous: bool


def associate(
    positions_m: FloatArray,
    covariances_m2: FloatArray,
    confirmed: NDArray[np.bool_],
    measured_m: FloatArray,
    noises_m2: FloatArray,
    gates: Gates,
) -> tuple[Match, ...]:
    """Match tracks to measurements one to one: confirmed tracks first, the others to what is left.

    The cost d² + ln det S is twice the negative log-likelihood of the measurement. Without its
    second term a track that has coasted, and so has a wide S, would take its neighbour's
    measurements. Each of the two rounds is solved by ``scipy.optimize.linear_sum_assignment``.

    Args:
        positions_m: (N, 2) predicted positions.
        covariances_m2: (N, 2, 2) of them.
        confirmed: (N,) True for the tracks of the first round.
        measured_m: (M, 2), same frame.
        noises_m2: (M, 2, 2) of them, positive definite.
        gates: both must let a match pass.
    """
    if not len(positions_m) or not len(measured_m):
        return ()
    cost = _costs(positions_m, covariances_m2, measured_m, noises_m2, gates)
    pairs: list[tuple[int, int]] = []
    free = np.ones(len(measured_m), dtype=bool)
    for round_tracks in (confirmed, ~confirmed):
        rows, columns = np.flatnonzero(round_tracks), np.flatnonzero(free)
        if not rows.size or not columns.size:
            continue
        allowed = cost[rows[:, None], columns]
        chosen = linear_sum_assignment(np.where(np.isfinite(allowed), allowed, _FORBIDDEN_COST))
        for row, column in zip(*chosen, strict=True):
            if np.isfinite(allowed[row, column]):
                pairs.append((int(rows[row]), int(columns[column])))
                free[columns[column]] = False
    doubt = _doubts(pairs, cost, positions_m, measured_m, gates)
    return tuple(Match(i, j, ambiguous) for (i, j), ambiguous in zip(pairs, doubt, strict=True))


def _costs(
    positions_m: FloatArray,
    covariances_m2: FloatArray,
    measured_m: FloatArray,
    noises_m2: FloatArray,
    gates: Gates,
) -> FloatArray:
    """Return d² + ln det S as (N, M), infinite where a gate is shut."""
    delta = measured_m[None, :, :] - positions_m[:, None, :]
    spread = covariances_m2[:, None] + noises_m2[None, :]
    s_xx, s_xy, s_yy = spread[..., 0, 0], spread[..., 0, 1], spread[..., 1, 1]
    x, y = delta[..., 0], delta[..., 1]
    determinant = s_xx * s_yy - s_xy * s_xy
    distance2 = (s_yy * x * x - 2.0 * s_xy * x * y + s_xx * y * y) / determinant
    allowed = (distance2 <= gates.mahalanobis2) & (np.hypot(x, y) <= gates.distance_m)
    return np.where(allowed, distance2 + np.log(determinant), np.inf)


def _doubts(
    pairs: list[tuple[int, int]],
    cost: FloatArray,
    positions_m: FloatArray,
    measured_m: FloatArray,
    gates: Gates,
) -> list[bool]:
    """Say for each pair whether a rival track, or a rival measurement, fits about as well."""
    if cost.size == 1:
        return [False] * len(pairs)
    doubts: list[bool] = []
    for track, measurement in pairs:
        limit = cost[track, measurement] + gates.ambiguity_margin
        tracks = cost[:, measurement] <= limit
        measurements = cost[track] <= limit
        tracks[track] = measurements[measurement] = False
        doubts.append(
            _any_near(positions_m[tracks], positions_m[track], gates.ambiguity_distance_m)
            or _any_near(
                measured_m[measurements], measured_m[measurement], gates.ambiguity_distance_m
            )
        )
    return doubts


def _any_near(points_m: FloatArray, point_m: FloatArray, distance_m: float) -> bool:
    if not len(points_m):
        return False
    offset = points_m - point_m
    return bool((np.hypot(offset[:, 0], offset[:, 1]) <= distance_m).any())
