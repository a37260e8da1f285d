"""The mounting of a laser scanner on a robot."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_array, finite_number, rigid_transform, set_fields
from ..errors import PerceptionError
from ._scan import LaserScan

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
