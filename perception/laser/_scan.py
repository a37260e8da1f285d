"""One sweep of a 2-D laser scanner, with the fields of sensor_msgs/LaserScan."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_array, finite_number, set_fields
from ..errors import PerceptionError

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
        intensities: (N,) strength of each return in the device's own unit; None without.

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
    intensities: FloatArray | None = None
    # The range of a ray without a return, beside +inf; NaN if there is none.
    _nothing_m: float = field(init=False, repr=False)

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
        far = ranges[(ranges >= high * _NO_RETURN_SHARE) & (ranges <= high * (1.0 + _ROUNDING))]
        nothing = float(far.max()) if len(far) >= _NO_RETURN_RAYS else np.nan
        if np.count_nonzero(far == nothing) < _NO_RETURN_RAYS:
            nothing = np.nan
        intensities = self.intensities
        if intensities is not None:
            intensities = _numbers("intensities", intensities)
            if intensities.shape != ranges.shape:
                raise PerceptionError(
                    f"intensities must have the shape of ranges_m, {ranges.shape}, got "
                    f"{intensities.shape}"
                )
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s),
            angle_min_rad=finite_number("angle_min_rad", self.angle_min_rad),
            angle_increment_rad=increment,
            ranges_m=ranges,
            range_min_m=low,
            range_max_m=high,
            time_increment_s=finite_number("time_increment_s", self.time_increment_s, minimum=0.0),
            intensities=intensities,
            _nothing_m=nothing,
        )

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

    @property
    def measured(self) -> NDArray[np.bool_]:
        """(N,) True for rays that measured an object within the limits."""
        ranges = self.ranges_m
        within = (ranges >= self.range_min_m) & (ranges <= self.range_max_m)
        within &= ranges > 0.0  # many drivers send 0 for no return, and some 0 for range_min too
        return np.asarray(within & (ranges != self._nothing_m))

    def repeats(self, before: LaserScan) -> bool:
        """Return whether all ranges are those of another scan, and some ray measured something.

        A live scanner has noise. It is frozen if this holds while the robot moves.
        """
        same = np.array_equal(self.ranges_m, before.ranges_m, equal_nan=True)
        return bool(same and self.measured.any())

    @property
    def no_return(self) -> NDArray[np.bool_]:
        """(N,) True for rays that met no object within ``range_max_m``."""
        return np.asarray((self.ranges_m == np.inf) | (self.ranges_m == self._nothing_m))

    def free_of(self, measured: NDArray[np.bool_]) -> FloatArray:
        """Return the distance (N,) over which each ray met nothing.

        It is the range where there is one, ``range_max_m`` for :attr:`no_return`, and 0 where
        nothing is known. :attr:`measured` (N,) is given.
        """
        free = np.where(measured, self.ranges_m, 0.0)
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
