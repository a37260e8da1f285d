"""The robot: its profile and its state."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from shapely.geometry import MultiPoint

from perception.arrays import FloatArray, finite_array, finite_number, set_fields

from ._errors import NavError

# An outline below one square millimetre is a line or a point.
_SMALLEST_FOOTPRINT_M2 = 1e-6


@dataclass(frozen=True, eq=False)
class RobotProfile:
    """The robot's footprint and its limits of motion.

    Attributes:
        footprint_m: (M, 2), M ≥ 3, corners in the base frame (x forward, y left), clockwise or
            counter-clockwise. The convex hull counts.
        max_speed_mps: > 0.
        max_acceleration_mps2: > 0.
        max_deceleration_mps2: > 0, a deceleration that the brakes always reach.
        reaction_time_s: ≥ 0, from a change in the scene to the start of braking: exposure,
            perception, the period of the control loop and the delay of the drive.
    """

    footprint_m: FloatArray
    max_speed_mps: float
    max_acceleration_mps2: float
    max_deceleration_mps2: float
    reaction_time_s: float

    def __post_init__(self) -> None:
        footprint = finite_array("footprint_m", self.footprint_m, ("M", 2), NavError)
        if len(footprint) < 3:
            raise NavError(f"footprint_m must have at least 3 corners, got {len(footprint)}")
        area = float(MultiPoint(footprint).convex_hull.area)
        if area < _SMALLEST_FOOTPRINT_M2:
            raise NavError(
                f"footprint_m must enclose at least {_SMALLEST_FOOTPRINT_M2:g} m², got {area:g} m²"
            )

        def positive(name: str) -> float:
            return finite_number(
                name, getattr(self, name), NavError, minimum=0.0, exclusive_minimum=True
            )

        set_fields(
            self,
            footprint_m=footprint,
            max_speed_mps=positive("max_speed_mps"),
            max_acceleration_mps2=positive("max_acceleration_mps2"),
            max_deceleration_mps2=positive("max_deceleration_mps2"),
            reaction_time_s=finite_number(
                "reaction_time_s", self.reaction_time_s, NavError, minimum=0.0
            ),
        )

    @cached_property
    def circumscribed_radius_m(self) -> float:
        """Radius of the circle about the base origin that contains the footprint."""
        return float(np.linalg.norm(self.footprint_m, axis=1).max())


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """The robot's pose and velocity.

    Attributes:
        stamp_s: time of the state.
        position_odom_m: (2,).
        heading_odom_rad: counter-clockwise from the x axis of odom.
        speed_mps: signed, forward positive.
        yaw_rate_radps: counter-clockwise positive.
    """

    stamp_s: float
    position_odom_m: FloatArray
    heading_odom_rad: float
    speed_mps: float
    yaw_rate_radps: float

    def __post_init__(self) -> None:
        set_fields(
            self,
            position_odom_m=finite_array("position_odom_m", self.position_odom_m, (2,), NavError),
            **{
                name: finite_number(name, getattr(self, name), NavError)
                for name in ("stamp_s", "heading_odom_rad", "speed_mps", "yaw_rate_radps")
            },
        )
