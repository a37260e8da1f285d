"""Frames as the tracker keeps them: checked at its door, with measurements in the odom frame."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from perception import PersonObservation
from perception.arrays import FloatArray
from perception.evidence import AwarenessReason

from ._errors import TrackingError
from ._views import View
from .awareness_filter import Evidence, evidence, trusted_std

# Limits far beyond any place a robot drives; the squares of larger numbers may overflow.
_MAX_POSITION_M: Final = 1e7
_MAX_VARIANCE_M2: Final = 1e6
_LEAST_RANGE_M: Final = 1e-3
# No sensor of a robot sees further, and no range is less certain. Within them determinants keep
# their digits.
_MAX_RANGE_M: Final = 1e5
_MAX_LASTING_STD: Final = 1.0
# A size that differs from an adult's by more than a factor of 100 is none.
_MAX_SIZE_LOG: Final = math.log(100.0)
# Nearer than a nanometre, places have no direction from each other.
_NO_OFFSET_M2: Final = 1e-18
# Largest difference between the stamps of an observation and of its frame.
_STAMP_TOLERANCE_S: Final = 1e-3
# Smallest standard deviation of a measured position in any direction of the floor plane.
_NOISE_FLOOR_M: Final = 0.05
# A detection with a lower score may continue a confirmed track that no other continues. It never
# starts one, and is no evidence of awareness. The shipped detector reports none unless its
# ``score_threshold`` is lowered.
_WEAK_SCORE: Final = 0.25
_FACE_MISSED: Final[AwarenessReason] = "face missed"


@dataclass(slots=True)
class Spread:
    """A symmetric 2 × 2 covariance on the floor plane.

    Attributes:
        xx: variance along x.
        xy: covariance of x and y.
        yy: variance along y.
    """

    xx: float
    xy: float
    yy: float

    def plus(self, other: Spread) -> Spread:
        """Return the sum of two covariances."""
        return Spread(self.xx + other.xx, self.xy + other.xy, self.yy + other.yy)

    def times(self, factor: float) -> Spread:
        """Return the covariance with all its variances multiplied."""
        return Spread(factor * self.xx, factor * self.xy, factor * self.yy)

    def along(self, x: float, y: float) -> float:
        """Return the variance in the direction of an offset (x, y); in the mean of all without."""
        length2 = x * x + y * y
        if length2 < _NO_OFFSET_M2:
            return 0.5 * (self.xx + self.yy)
        return (self.xx * x * x + 2.0 * self.xy * x * y + self.yy * y * y) / length2

    def distance2_and_log_det(self, x: float, y: float) -> tuple[float, float]:
        """Return the squared Mahalanobis distance of an offset (x, y), and ln det."""
        determinant = self.xx * self.yy - self.xy * self.xy
        squared = self.yy * x * x - 2.0 * self.xy * x * y + self.xx * y * y
        return squared / determinant, math.log(determinant)


def outer(x: float, y: float, factor: float = 1.0) -> Spread:
    """Return factor · v vᵀ of a vector v = (x, y)."""
    return Spread(factor * x * x, factor * x * y, factor * y * y)


@dataclass(slots=True, eq=False)
class Measurement:
    """One observation of a frame, checked and transformed to the odom frame.

    Attributes:
        x: in odom, on the floor plane.
        y: in odom, on the floor plane.
        noise_m2: covariance of x and y, positive definite.
        evidence: of awareness; None for no evidence.
        weak: whether the score is below 0.25.
        lasting_std: part of the range's relative standard deviation that lasts; it is not in
            ``noise_m2`` (``_size``).
        size_log: ln of the range by an adult's size over the range; None where unknown.
        size_variance: of it, but for the size of the person.
        face_missed: whether the head is turned here, and the network of faces finds no face.
    """

    x: float
    y: float
    noise_m2: Spread
    evidence: Evidence | None = None
    weak: bool = False
    lasting_std: float = 0.0
    size_log: float | None = None
    size_variance: float = 0.0
    face_missed: bool = False


class Frame(NamedTuple):
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
    measurements: list[Measurement]
    sensor: int = 0
    view: View | None = None


def measurements_of(
    observations: Iterable[PersonObservation],
    stamp_s: float,
    T_odom_camera: FloatArray,
    pose_covariance_odom: FloatArray | None,
) -> list[Measurement]:
    """Return the observations of the frame at ``stamp_s`` as measurements.

    A position covariance is rotated with the camera, R Σ Rᵀ, and its x–y block is kept. The part
    that lasts from frame to frame is taken out, since the filter takes errors for independent.
    A pose covariance (3, 3) of the camera's x, y and yaw adds J Σ Jᵀ with J = [I, (t_y − p_y,
    p_x − t_x)]: an error in yaw moves a person in proportion to their range.

    Raises:
        TrackingError: naming an observation that is not a ``PersonObservation``, has another stamp
            than the frame, or lies out of bounds.
    """
    checked = _checked_observations(observations, stamp_s)
    to_x, to_y = T_odom_camera[:2].tolist()
    pose = None if pose_covariance_odom is None else pose_covariance_odom.tolist()
    return [
        _measurement(f"observations[{index}]", one, to_x, to_y, pose)
        for index, one in enumerate(checked)
    ]


def _measurement(
    name: str,
    one: PersonObservation,
    to_x: list[float],
    to_y: list[float],
    pose: list[list[float]] | None,
) -> Measurement:
    """Return an observation, given the two rows of T_odom_camera that lead to the floor plane."""
    a, b, c = one.position_camera_m.tolist()
    range_m, lasting = math.hypot(a, b, c), one.range_lasting_relative_std
    if range_m > _MAX_RANGE_M:
        raise TrackingError(
            f"{name}.position_camera_m must lie within {_MAX_RANGE_M:g} m of the sensor, got "
            f"{[a, b, c]} m"
        )
    if lasting > _MAX_LASTING_STD:
        raise TrackingError(
            f"{name}.range_lasting_relative_std must be at most {_MAX_LASTING_STD:g}, got "
            f"{lasting:g}"
        )
    spread = one.position_covariance_m2.tolist()
    ax, bx, cx, origin_x = to_x
    ay, by, cy, origin_y = to_y
    east, north = ax * a + bx * b + cx * c, ay * a + by * b + cy * c
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = spread
    # Σ times each of the two rows.
    e_x, e_y, e_z = (
        xx * ax + xy * bx + xz * cx,
        xy * ax + yy * bx + yz * cx,
        xz * ax + yz * bx + zz * cx,
    )
    n_x, n_y, n_z = (
        xx * ay + xy * by + xz * cy,
        xy * ay + yy * by + yz * cy,
        xz * ay + yz * by + zz * cy,
    )
    noise = Spread(
        ax * e_x + bx * e_y + cx * e_z,
        ax * n_x + bx * n_y + cx * n_z,
        ay * n_x + by * n_y + cy * n_z,
    )
    if lasting:
        noise = noise.plus(outer(east, north, -lasting * lasting))
    if pose is not None:
        noise = noise.plus(_pose_noise(east, north, pose))
    x, y = origin_x + east, origin_y + north
    # Written so that NaN from an overflow is refused as well.
    if not (abs(x) <= _MAX_POSITION_M and abs(y) <= _MAX_POSITION_M):
        raise TrackingError(
            f"{name} must lie within {_MAX_POSITION_M:g} m of the origin of odom, got {[x, y]} m"
        )
    if not noise.xx + noise.yy <= _MAX_VARIANCE_M2:
        raise TrackingError(
            f"{name}.position_covariance_m2 must sum to at most {_MAX_VARIANCE_M2:g} m² on the "
            f"floor plane, the pose's share included, got {noise.xx + noise.yy:g} m²"
        )
    measured = Measurement(
        x,
        y,
        with_noise_floor(noise),
        evidence(one.awareness, trusted_std(one.awareness_std)),
        one.score < _WEAK_SCORE,
        lasting,
        face_missed=one.awareness_reason == _FACE_MISSED,
    )
    if one.size_range_m is not None and one.size_range_relative_std is not None:
        size_log = math.log(one.size_range_m) - math.log(max(range_m, _LEAST_RANGE_M))
        if abs(size_log) <= _MAX_SIZE_LOG:
            measured.size_log, measured.size_variance = size_log, one.size_range_relative_std**2
    return measured


def _checked_observations(observations: Any, stamp_s: float) -> tuple[PersonObservation, ...]:
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
        if abs(one.stamp_s - stamp_s) > _STAMP_TOLERANCE_S:
            raise TrackingError(
                f"observations[{index}].stamp_s = {one.stamp_s!r} s must be that of its frame, "
                f"{stamp_s!r} s, within {_STAMP_TOLERANCE_S:g} s"
            )
    return checked


def _pose_noise(east_m: float, north_m: float, pose: list[list[float]]) -> Spread:
    """Return the covariance that an uncertain pose adds at an offset from the sensor."""
    (xx, xy, xt), (_, yy, yt), (_, _, tt) = pose
    return Spread(
        xx - 2.0 * north_m * xt + north_m * north_m * tt,
        xy + east_m * xt - north_m * yt - east_m * north_m * tt,
        yy + 2.0 * east_m * yt + east_m * east_m * tt,
    )


def with_noise_floor(spread_m2: Spread) -> Spread:
    """Return a covariance with no standard deviation below 0.05 m in any direction.

    Eigenvalues below the floor are raised to it and the eigenvectors are kept, in closed form: the
    result of a rotated covariance is the rotated result.
    """
    xx, xy, yy = spread_m2.xx, spread_m2.xy, spread_m2.yy
    centre, radius = 0.5 * (xx + yy), math.hypot(0.5 * (xx - yy), xy)
    low, high, floor = centre - radius, centre + radius, _NOISE_FLOOR_M * _NOISE_FLOOR_M
    if low >= floor:
        return spread_m2
    # A covariance below the floor in every direction becomes isotropic.
    scale = (high - floor) / (high - low) if high > floor else 0.0
    return Spread(floor + scale * (xx - low), scale * xy, floor + scale * (yy - low))
