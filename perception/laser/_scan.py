"""One sweep of a 2-D laser scanner (sensor_msgs/LaserScan), and the scanner's mounting."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_array, finite_number, rigid_transform, set_fields
from ..errors import PerceptionError
from ..no_view import LastFrames

# More than a full turn is no 2-D sweep; the rest is the rounding of 32-bit messages.
_MAX_TURN_RAD: Final = 2.0 * np.pi + 0.02
# Many drivers send range_max, or a little less, for a ray that met nothing. So many rays have
# exactly that value; noise makes those of a wall differ. The 32 bits of a message round it up too.
_NO_RETURN_SHARE: Final = 0.99
_NO_RETURN_RAYS: Final = 3
_ROUNDING: Final = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan:
    """One sweep of a 2-D laser scanner; the fields are those of sensor_msgs/LaserScan.

    Ranges follow REP-117: −inf is an object too near to measure, +inf is no object within
    ``range_max_m``, NaN is an invalid measurement. A finite range outside the limits is discarded
    like NaN. Where three rays or more have exactly ``range_max_m``, or one and the same range up to
    1 per cent below it that no other ray exceeds, they met no object, like those of +inf.

    Attributes:
        stamp_s: time of the first ray.
        angle_min_rad: angle of the first ray about the scanner's z axis, from x.
        angle_increment_rad: angle from one ray to the next; negative for a scanner that turns
            clockwise.
        ranges_m: (N,) range of each ray, N ≥ 1; may hold NaN and ±inf.
        range_min_m: shortest range that counts.
        range_max_m: longest range that counts.
        time_increment_s: time from one ray to the next; 0 for a sweep at one instant.
        measured: (N,) True for rays that measured an object within the limits; made from the rest.
        no_return: (N,) True for rays that met no object within ``range_max_m``; made as well.

    Raises:
        PerceptionError: for a wrong shape, limits in the wrong order, or more than a full turn.
    """

    stamp_s: float
    angle_min_rad: float
    angle_increment_rad: float
    ranges_m: FloatArray
    range_min_m: float
    range_max_m: float
    time_increment_s: float = 0.0
    measured: NDArray[np.bool_] = field(init=False, repr=False)
    no_return: NDArray[np.bool_] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        ranges = _numbers("ranges_m", self.ranges_m)
        if not ranges.size:
            raise PerceptionError("ranges_m must hold at least one range, got none")
        increment = finite_number("angle_increment_rad", self.angle_increment_rad)
        turn = abs(increment) * (len(ranges) - 1)
        if increment == 0.0 or turn > _MAX_TURN_RAD:
            raise PerceptionError(
                "angle_increment_rad must not be 0, and the rays must cover at most a full turn, "
                f"got {increment:g} rad for {len(ranges)} rays ({turn:g} rad)"
            )
        low = finite_number("range_min_m", self.range_min_m, minimum=0.0)
        high = finite_number("range_max_m", self.range_max_m)
        if high <= low:
            raise PerceptionError(
                f"range_max_m must exceed range_min_m, got {high:g} and {low:g} m"
            )
        # The range of a ray without a return, beside +inf.
        far = ranges[(ranges >= high * _NO_RETURN_SHARE) & (ranges <= high * (1.0 + _ROUNDING))]
        code_m = float(far.max()) if len(far) >= _NO_RETURN_RAYS else None
        if code_m is not None and np.count_nonzero(far == code_m) < _NO_RETURN_RAYS:
            code_m = None
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            angle_min_rad=finite_number("angle_min_rad", self.angle_min_rad),
            angle_increment_rad=increment,
            ranges_m=ranges,
            range_min_m=low,
            range_max_m=high,
            time_increment_s=finite_number("time_increment_s", self.time_increment_s, minimum=0.0),
        )
        within = (ranges >= low) & (ranges <= high)
        within &= ranges > 0.0  # many drivers send 0 for no return, and some 0 for range_min too
        nothing = ranges == np.inf
        if code_m is not None:
            coded = ranges == code_m
            within &= ~coded
            nothing |= coded
        for mask in (within, nothing):
            mask.setflags(write=False)
        set_fields(self, measured=within, no_return=nothing)

    def __len__(self) -> int:
        return len(self.ranges_m)

    @property
    def angles_rad(self) -> FloatArray:
        """The angle (N,) of every ray."""
        rays = np.arange(len(self.ranges_m), dtype=np.float64)
        return np.asarray(self.angle_min_rad + self.angle_increment_rad * rays)

    @property
    def stamps_s(self) -> FloatArray:
        """The time (N,) of every ray."""
        rays = np.arange(len(self.ranges_m), dtype=np.float64)
        return np.asarray(self.stamp_s + self.time_increment_s * rays)

    @property
    def end_s(self) -> float:
        """The time of the last ray."""
        return self.stamp_s + self.time_increment_s * (len(self.ranges_m) - 1)

    def repeats(self, last: LastFrames, T_odom_robot: FloatArray | None = None) -> bool:
        """Return whether the scanner is frozen: :meth:`LastFrames.repeats`, of the ranges.

        A scan whose rays have measured nothing is none that repeats.
        """
        return bool(self.measured.any()) and last.repeats(self.ranges_m, T_odom_robot)

    @property
    def free_m(self) -> FloatArray:
        """The distance (N,) over which each ray met nothing.

        It is the range where there is one, ``range_max_m`` for :attr:`no_return`, and 0 where
        nothing is known.
        """
        free = np.where(self.measured, self.ranges_m, 0.0)
        np.putmask(free, self.no_return, self.range_max_m)
        return free


def _numbers(name: str, value: Any) -> FloatArray:
    """Return a read-only (N,) copy; unlike elsewhere NaN and infinity are allowed."""
    try:
        array = np.array(value, dtype=np.float64, copy=True)
    except (TypeError, ValueError):
        return finite_array(name, value, ("N",))  # raises, with the usual message
    if array.ndim != 1:
        raise PerceptionError(f"{name} must have shape (N,), got {array.shape}")
    array.setflags(write=False)
    return array


#: Returns this near to the outline of the robot's body are its own: noise, bumpers, cables.
BODY_MARGIN_M: Final = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Scanner:
    """The place of a scanner on the robot, and the part of its rays that is used.

    Attributes:
        T_base_scanner: (4, 4) pose of the scanner (rays in its x-y plane, counter-clockwise about
            z) in the base frame (REP-105: x forward, y left, z up).
        field_of_view_rad: lowest and highest angle about the scanner's z axis that is used; rays
            outside it, which may see the robot's own body, are dropped.
        body_base_m: (M, 2) outline of the robot in the base frame; returns inside it, or within
            5 cm, are dropped. None drops nothing.

    Raises:
        PerceptionError: for a transform that is not rigid, angles in the wrong order, or an outline
            of fewer than three corners.
    """

    T_base_scanner: FloatArray
    field_of_view_rad: tuple[float, float] = (-2.0 * math.pi, 2.0 * math.pi)
    body_base_m: FloatArray | None = None

    def __post_init__(self) -> None:
        view = finite_array("field_of_view_rad", self.field_of_view_rad, (2,)).tolist()
        if not view[0] < view[1]:
            raise PerceptionError(
                "field_of_view_rad must be the lowest and the highest angle, got "
                f"{view[0]:g} and {view[1]:g} rad"
            )
        body = self.body_base_m
        if body is not None:
            body = finite_array("body_base_m", body, ("M", 2))
            if len(body) < 3:
                raise PerceptionError(f"body_base_m must have 3 or more corners, got {len(body)}")
        set_fields(
            self,
            T_base_scanner=rigid_transform("T_base_scanner", self.T_base_scanner),
            field_of_view_rad=(view[0], view[1]),
            body_base_m=body,
        )

    @classmethod
    def mounted(
        cls,
        x_m: float,
        y_m: float,
        z_m: float,
        yaw_rad: float = 0.0,
        *,
        upside_down: bool = False,
        field_of_view_rad: tuple[float, float] = (-2.0 * math.pi, 2.0 * math.pi),
        body_base_m: FloatArray | None = None,
    ) -> Scanner:
        """Return a level scanner.

        Args:
            x_m: place ahead of the base frame's origin.
            y_m: place to its left.
            z_m: height above it.
            yaw_rad: direction of the scanner's x axis, counter-clockwise from the robot's.
            upside_down: the scanner's z axis points down, so its rays turn clockwise.
            field_of_view_rad: see :class:`Scanner`.
            body_base_m: see :class:`Scanner`.
        """
        yaw = finite_number("yaw_rad", yaw_rad)
        side = -1.0 if upside_down else 1.0
        T = np.eye(4)
        T[:2, 0] = math.cos(yaw), math.sin(yaw)
        T[:2, 1] = -side * math.sin(yaw), side * math.cos(yaw)
        T[2, 2] = side
        T[:3, 3] = finite_array("x_m, y_m, z_m", (x_m, y_m, z_m), (3,))
        return cls(T, field_of_view_rad, body_base_m)

    def sees(self, scan: LaserScan) -> NDArray[np.bool_]:
        """Return (N,) whether each ray lies in the field of view."""
        return self.covers(scan.angles_rad)

    def covers(self, angles_rad: FloatArray) -> NDArray[np.bool_]:
        """Return (N,) whether each angle about the scanner's z axis lies in the field of view."""
        low, high = self.field_of_view_rad
        slack = 1e-6  # the rounding of angles that come as 32-bit numbers
        return np.asarray((angles_rad >= low - slack) & (angles_rad <= high + slack))

    def is_body(self, points_base_m: FloatArray) -> NDArray[np.bool_]:
        """Return (N,) whether points (N, 2) lie on the robot's own body."""
        if self.body_base_m is None:
            return np.zeros(len(points_base_m), dtype=bool)
        first = self.body_base_m
        edges = np.roll(first, -1, axis=0) - first
        to = points_base_m[:, None] - first
        squares = np.maximum((edges * edges).sum(axis=1), 1e-12)
        share = np.clip((to * edges).sum(axis=2) / squares, 0.0, 1.0)
        off = to - share[..., None] * edges
        near = ((off * off).sum(axis=2) <= BODY_MARGIN_M**2).any(axis=1)
        # A point is inside if a line from it crosses the outline an odd number of times.
        above, height = to[..., 1] >= 0.0, np.where(edges[:, 1] == 0.0, 1e-12, edges[:, 1])
        crosses = above != (to[..., 1] - edges[:, 1] >= 0.0)
        crosses &= to[..., 0] < edges[:, 0] * (to[..., 1] / height)
        return np.asarray(near | (crosses.sum(axis=1) % 2 == 1))
