"""What one observation says in the odom frame: a place on the floor plane, its noise, evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray

from ._awareness_filter import evidence
from ._config import TrackerConfig
from ._errors import TrackingError

# Beyond these a number may be finite but is no place a robot drives, and its square may overflow.
_MAX_POSITION_M: Final = 1e7
_MAX_VARIANCE_M2: Final = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """One observation, checked and carried to the odom frame.

    Attributes:
        position_odom_m: (2,).
        noise_m2: (2, 2) positive definite covariance of it.
        evidence: mean and variance of logit(α), or None for "no evidence".
    """

    position_odom_m: FloatArray
    noise_m2: FloatArray
    evidence: tuple[float, float] | None


def measurement_of(
    observation: Any, name: str, stamp_s: float, T_odom_camera: FloatArray, config: TrackerConfig
) -> Measurement:
    """Return an observation of the frame at ``stamp_s`` as a measurement.

    The position covariance turns with the camera, R Σ Rᵀ, and its x–y block remains.

    Raises:
        TrackingError: naming the observation by ``name``, when it is no ``PersonObservation``,
            carries another frame's stamp or lies out of this world.
    """
    if not isinstance(observation, PersonObservation):
        raise TrackingError(f"{name} must be a PersonObservation, got {type(observation).__name__}")
    if abs(observation.stamp_s - stamp_s) > config.stamp_tolerance_s:
        raise TrackingError(
            f"{name}.stamp_s = {observation.stamp_s!r} s must be that of its frame, "
            f"{stamp_s!r} s, within {config.stamp_tolerance_s:g} s"
        )
    to_floor = T_odom_camera[:2, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        position = to_floor @ observation.position_camera_m + T_odom_camera[:2, 3]
        noise = to_floor @ observation.position_covariance_m2 @ to_floor.T
        variance = float(noise[0, 0] + noise[1, 1])
    # Written so that NaN, from overflow, is refused as well.
    if not all(abs(value) <= _MAX_POSITION_M for value in position.tolist()):
        raise TrackingError(
            f"{name} must lie within {_MAX_POSITION_M:g} m of the origin of odom, "
            f"got {position.tolist()} m"
        )
    if not variance <= _MAX_VARIANCE_M2:
        raise TrackingError(
            f"{name}.position_covariance_m2 must sum to at most {_MAX_VARIANCE_M2:g} m² on the "
            f"floor plane, got {variance:g} m²"
        )
    alpha, alpha_std = observation.awareness, observation.awareness_std
    return Measurement(
        position,
        floor_covariance(noise, config.position_noise_floor_m),
        None
        if alpha is None or alpha_std is None
        else evidence(alpha, alpha_std, config.awareness),
    )


def floor_covariance(covariance_m2: FloatArray, floor_m: float) -> FloatArray:
    """Return a (2, 2) covariance with no standard deviation below ``floor_m`` in any direction.

    Eigenvalues below the floor are raised to it and the eigenvectors kept, in closed form: turning
    the world turns the result.
    """
    xx, yy = float(covariance_m2[0, 0]), float(covariance_m2[1, 1])
    xy = 0.5 * float(covariance_m2[0, 1] + covariance_m2[1, 0])
    centre, radius = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    low, high, floor = centre - radius, centre + radius, floor_m * floor_m
    if low >= floor:
        return np.array([[xx, xy], [xy, yy]])
    if high <= floor:
        return np.array([[floor, 0.0], [0.0, floor]])
    scale = (high - floor) / (high - low)
    return np.array(
        [
            [floor + scale * (xx - low), scale * xy],
            [scale * xy, floor + scale * (yy - low)],
        ]
    )
