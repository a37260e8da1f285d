"""The protective field of a safety laser scanner, for the baseline policy ``scanner``."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._memory import Vector2
from ._robot import RobotState


class StraightPath:
    """The straight path of a robot's footprint along its direction of travel.

    The fields of safety scanners are rectangles ahead of the robot: its width with a supplement on
    either side, and its stopping distance with supplements. The length is that of speed and
    separation; this class has the width. For a standing robot the path leads along its heading.

    Args:
        footprint_m: (M, 2) corners in the base frame.
        beside_m: supplement on either side.
    """

    def __init__(self, footprint_m: FloatArray, beside_m: float) -> None:
        self._corners: Final[list[list[float]]] = np.asarray(footprint_m).tolist()
        self._beside_m = beside_m

    def holds(self, position_odom_m: Vector2, robot_state: RobotState, error_m: float) -> bool:
        """Return whether a person's body disc reaches into the path, or beside the robot.

        Args:
            position_odom_m: of the body's centre line.
            robot_state: place, heading and velocity of the robot.
            error_m: how far the position may be wrong.
        """
        travel_x, travel_y = robot_state.travel_direction_odom
        heading = robot_state.heading_odom_rad
        # The direction of travel in the base frame.
        cos, sin = math.cos(heading), math.sin(heading)
        ahead_x, ahead_y = cos * travel_x + sin * travel_y, cos * travel_y - sin * travel_x
        along = [x * ahead_x + y * ahead_y for x, y in self._corners]
        across = [y * ahead_x - x * ahead_y for x, y in self._corners]
        robot_x, robot_y = robot_state.position_odom_m.tolist()
        x: float = position_odom_m[0] - robot_x
        y: float = position_odom_m[1] - robot_y
        forward_m, left_m = travel_x * x + travel_y * y, travel_x * y - travel_y * x
        body_m = BODY_RADIUS_M + error_m
        reach_m = body_m + self._beside_m
        return (
            min(across) - reach_m <= left_m <= max(across) + reach_m
            and forward_m >= min(along) - body_m
        )
