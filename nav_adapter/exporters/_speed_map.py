"""The speed limit as a map, for planners that choose a way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray, finite_array, finite_number, set_fields
from perception.short_repr import short_repr

from .._checks import checked_square
from .._constraints import NavConstraints
from .._errors import NavError
from ._person_costs import checked_grid
from ._speed_field import limits_at


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SpeedMap:
    """The speed limit of every cell of a grid in the odom frame.

    Attributes:
        stamp_s: of the constraints.
        origin_odom_m: (2,) lower left corner of cell (0, 0).
        resolution_m: side of a cell.
        max_speed_mps: the robot's maximum.
        limits_mps: (H, W) limits; rows run along y, columns along x.
    """

    stamp_s: float
    origin_odom_m: FloatArray
    resolution_m: float
    max_speed_mps: float
    limits_mps: FloatArray

    __repr__ = short_repr

    def __post_init__(self) -> None:
        origin, resolution = checked_grid(self.origin_odom_m, self.resolution_m)
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s, NavError),
            origin_odom_m=origin,
            resolution_m=resolution,
            max_speed_mps=finite_number(
                "max_speed_mps", self.max_speed_mps, NavError, minimum=0.0, exclusive_minimum=True
            ),
            limits_mps=finite_array("limits_mps", self.limits_mps, ("H", "W"), NavError),
        )

    @property
    def percent(self) -> NDArray[np.int8]:
        """The values (H, W) of Nav2's speed filter mask, in per cent of the maximum speed.

        They are rounded down. 0 means no limit there, as Nav2 reads it, so a stop is 1: Nav2's
        speed filter cannot stop a robot.
        """
        share = self.limits_mps / self.max_speed_mps
        values = np.clip(np.floor(100.0 * share + 1e-9), 1, 100).astype(np.int8)
        values[share >= 1.0] = 0
        return values

    @classmethod
    def around(
        cls,
        constraints: NavConstraints,
        center_odom_m: Any,
        *,
        size_m: float = 10.0,
        resolution_m: float = 0.05,
        times_s: Sequence[float] = (0.0,),
    ) -> SpeedMap:
        """Return the map of a square around a point, people moving as predicted.

        A cell has the limit of :func:`speed_limit_at` for a robot anywhere in it that drives
        straight on, turns or stands, with any heading. The corner of the map is rounded to whole
        cells.

        Args:
            constraints: of ``NavAdapter.update``.
            center_odom_m: (2,), usually the robot.
            size_m: side of the square.
            resolution_m: side of a cell, at least 1 mm.
            times_s: seconds after the constraints' stamp, ≥ 0; the lowest limit of them counts.

        Raises:
            NavError: for numbers that are not finite or out of bounds, more than four million
                cells, or constraints that do not come from ``update``.
        """
        origin, cell, side = checked_square("map", center_odom_m, size_m, resolution_m)
        times = finite_array("times_s", times_s, ("T",), NavError)
        if not len(times) or bool((times < 0.0).any()):
            raise NavError(f"times_s must be one or more numbers >= 0, got {times_s!r:.80}")
        robot = constraints.robot
        if constraints.speed_basis is None or robot is None:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        along = (np.arange(side) + 0.5) * cell
        positions = np.empty((side, side, 2))
        positions[:, :, 0] = origin[0] + along
        positions[:, :, 1] = (origin[1] + along)[:, None]
        positions = positions.reshape(-1, 1, 2)
        limits = np.full(side * side, robot.max_speed_mps)
        for time_s in times:
            at_time = limits_at(
                *(constraints, positions, None, None, 0.0, np.array([time_s]), math.inf),
                reach_m=math.sqrt(0.5) * cell,
            )
            np.minimum(limits, at_time[:, 0], out=limits)
        return cls(
            constraints.stamp_s,
            origin,
            cell,
            robot.max_speed_mps,
            limits.reshape(side, side),
        )
