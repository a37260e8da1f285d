"""Frames as the tracker keeps them: checked, with measurements in the odom frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray

from ._config import TrackerConfig
from ._errors import TrackingError
from ._table import BoolArray
from ._views import View
from .awareness_filter import evidence, trusted_std

# Limits far beyond any place a robot drives; the squares of larger numbers may overflow.
_MAX_POSITION_M: Final = 1e7
_MAX_VARIANCE_M2: Final = 1e6
_LEAST_RANGE_M: Final = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """The M observations of one frame, checked and transformed to the odom frame.

    Attributes:
        positions_odom_m: (M, 2) on the floor plane.
        noises_m2: (M, 2, 2) of the positions, positive definite.
        evidence_means: (M,) of logit(α); NaN for "no evidence".
        evidence_variances: (M,) of logit(α); NaN for "no evidence".
        weak: (M,) True for detections with a score below ``weak_score``.
        lasting_stds: (M,) part of the range's relative standard deviation that lasts; it is not in
            ``noises_m2`` (``_sizes``).
        size_logs: (M,) ln of the range by an adult's size over the range; NaN where unknown.
        size_variances: (M,) of it, but for the size of the person; NaN where unknown.
    """

    positions_odom_m: FloatArray
    noises_m2: FloatArray
    evidence_means: FloatArray
    evidence_variances: FloatArray
    weak: BoolArray
    lasting_stds: FloatArray
    size_logs: FloatArray
    size_variances: FloatArray

    def __len__(self) -> int:
        return len(self.positions_odom_m)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One frame of a sensor: its pose and the people it shows.

    Attributes:
        stamp_s: time of the frame.
        T_odom_camera: (4, 4) pose of the camera, or of the other sensor.
        measurements: of the people in the frame.
        sensor: index of the sensor, 0 for the camera.
        view: of this frame alone; None for that of the sensor.
    """

    stamp_s: float
    T_odom_camera: FloatArray
    measurements: Measurements
    sensor: int = 0
    view: View | None = None


_NO_EVIDENCE = np.empty(0)
_NO_MEASUREMENTS = Measurements(
    np.empty((0, 2)),
    np.empty((0, 2, 2)),
    _NO_EVIDENCE,
    _NO_EVIDENCE,
    np.empty(0, dtype=np.bool_),
    _NO_EVIDENCE,
    _NO_EVIDENCE,
    _NO_EVIDENCE,
)


def measurements_of(
    observations: Iterable[PersonObservation],
    stamp_s: float,
    T_odom_camera: FloatArray,
    pose_covariance_odom: FloatArray | None,
    config: TrackerConfig,
) -> Measurements:
    """Return the observations of the frame at ``stamp_s`` as measurements.

    A position covariance is rotated with the camera, R Σ Rᵀ, and its x–y block is kept. The part
    that lasts from frame to frame is taken out, since the filter takes errors for independent.
    A pose covariance (3, 3) of the camera's x, y and yaw adds J Σ Jᵀ with J = [I, (t_y − p_y,
    p_x − t_x)]: an error in yaw moves a person in proportion to their range.

    Raises:
        TrackingError: naming an observation that is not a ``PersonObservation``, has another stamp
            than the frame, or lies out of bounds.
    """
    checked = _checked_observations(observations, stamp_s, config.stamp_tolerance_s)
    if not checked:
        return _NO_MEASUREMENTS
    to_floor, origin = T_odom_camera[:2, :3], T_odom_camera[:2, 3]
    places = np.concatenate([one.position_camera_m for one in checked]).reshape(-1, 3)
    spreads = np.concatenate([one.position_covariance_m2 for one in checked]).reshape(-1, 3, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        offsets = places @ to_floor.T
        positions = offsets + origin
        noises = to_floor @ spreads @ to_floor.T
        lasting = np.array([one.range_lasting_relative_std for one in checked])
        if lasting.any():
            moved = lasting[:, None] * offsets
            noises = noises - moved[:, :, None] * moved[:, None, :]
        if pose_covariance_odom is not None:
            noises = noises + _pose_noise(offsets, pose_covariance_odom)
        variances = noises[:, 0, 0] + noises[:, 1, 1]
        # Written so that NaN from an overflow is refused as well.
        inside = (np.abs(positions) <= _MAX_POSITION_M).all(axis=1)
        bounded = variances <= _MAX_VARIANCE_M2
    if not inside.all():
        index = int(np.argmin(inside))
        raise TrackingError(
            f"observations[{index}] must lie within {_MAX_POSITION_M:g} m of the origin of odom, "
            f"got {positions[index].tolist()} m"
        )
    if not bounded.all():
        index = int(np.argmin(bounded))
        raise TrackingError(
            f"observations[{index}].position_covariance_m2 must sum to at most "
            f"{_MAX_VARIANCE_M2:g} m² on the floor plane, the pose's share included, "
            f"got {variances[index]:g} m²"
        )
    stds = np.array([np.nan if one.awareness_std is None else one.awareness_std for one in checked])
    means, evidence_variances = evidence(
        np.array([np.nan if one.awareness is None else one.awareness for one in checked]),
        trusted_std(stds, config.awareness),
        config.awareness,
    )
    return Measurements(
        positions,
        with_noise_floor(noises, config.position_noise_floor_m),
        means,
        evidence_variances,
        np.array([one.score < config.weak_score for one in checked]),
        lasting,
        *_sizes(checked, places),
    )


def _sizes(
    checked: tuple[PersonObservation, ...], places_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ``size_logs`` and ``size_variances`` of the observations."""
    if all(one.size_range_m is None for one in checked):
        unknown = np.full(len(checked), np.nan)
        return unknown, unknown
    pairs = [(one.size_range_m, one.size_range_relative_std) for one in checked]
    ranges_m, stds = np.array(pairs, dtype=np.float64).T
    placed_m = np.maximum(np.sqrt((places_m * places_m).sum(axis=1)), _LEAST_RANGE_M)
    return np.log(ranges_m / placed_m), stds * stds


def _checked_observations(
    observations: Any, stamp_s: float, tolerance_s: float
) -> tuple[PersonObservation, ...]:
    """Return the observations after checking their types and stamps."""
    try:
        checked = tuple(observations)
    except TypeError as cause:
        raise TrackingError(
            "observations must be an iterable of PersonObservation, got "
            f"{type(observations).__name__}"
        ) from cause
    for index, one in enumerate(checked):
        if not isinstance(one, PersonObservation):
            raise TrackingError(
                f"observations[{index}] must be a PersonObservation, got {type(one).__name__}"
            )
        if abs(one.stamp_s - stamp_s) > tolerance_s:
            raise TrackingError(
                f"observations[{index}].stamp_s = {one.stamp_s!r} s must be that of its frame, "
                f"{stamp_s!r} s, within {tolerance_s:g} s"
            )
    return checked


def _pose_noise(offsets_m: FloatArray, pose_covariance: FloatArray) -> FloatArray:
    """Return (M, 2, 2), the covariance that an uncertain pose adds at ``offsets_m`` (M, 2)."""
    J = np.zeros((len(offsets_m), 2, 3))
    J[:, 0, 0] = J[:, 1, 1] = 1.0
    J[:, 0, 2], J[:, 1, 2] = -offsets_m[:, 1], offsets_m[:, 0]
    return np.asarray(J @ pose_covariance @ J.transpose(0, 2, 1))


def with_noise_floor(covariances_m2: FloatArray, floor_m: float) -> FloatArray:
    """Return (M, 2, 2) covariances with no standard deviation below ``floor_m`` in any direction.

    Eigenvalues below the floor are raised to it and the eigenvectors are kept, in closed form: the
    result of a rotated covariance is the rotated result.
    """
    xx, yy = covariances_m2[:, 0, 0], covariances_m2[:, 1, 1]
    xy = 0.5 * (covariances_m2[:, 0, 1] + covariances_m2[:, 1, 0])
    centre, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    low, high, floor = centre - radius, centre + radius, floor_m * floor_m
    floored = np.empty_like(covariances_m2)
    floored[:, 0, 0], floored[:, 1, 1] = xx, yy
    floored[:, 0, 1] = floored[:, 1, 0] = xy
    below = low < floor
    if below.any():
        # A covariance below the floor in every direction becomes isotropic: its scale is 0.
        split = high > floor
        scale = np.where(split, high - floor, 0.0) / np.where(split & below, high - low, 1.0)
        scale = scale[below]
        floored[below, 0, 0] = floor + scale * (xx - low)[below]
        floored[below, 1, 1] = floor + scale * (yy - low)[below]
        floored[below, 0, 1] = floored[below, 1, 0] = scale * xy[below]
    return floored
