"""What surrounds the robot at the instant of a plan, and how far any pose would be from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._planner_clearance import Rectangles, box_gap_m, disc_gap_m, strip_distance_m
from ._planner_rollout import Poses


@dataclass(frozen=True, slots=True, eq=False)
class Footprint:
    """The bounding rectangle of a robot's outline, along its axes.

    Attributes:
        center_m: (x, y) in the base frame.
        half_size_m: half the length and half the width.
        reach_m: distance from the base origin to the farthest corner.
        turning_room_m: how far the circle of that radius reaches beyond the front edge.
    """

    center_m: tuple[float, float]
    half_size_m: tuple[float, float]
    reach_m: float
    turning_room_m: float

    @classmethod
    def of(cls, robot: RobotProfile) -> Footprint:
        """Bound the outline of ``robot``."""
        x_min, y_min = robot.footprint_m.min(axis=0).tolist()
        x_max, y_max = robot.footprint_m.max(axis=0).tolist()
        reach = math.hypot(max(-x_min, x_max), max(-y_min, y_max))
        return cls(
            (0.5 * (x_min + x_max), 0.5 * (y_min + y_max)),
            (0.5 * (x_max - x_min), 0.5 * (y_max - y_min)),
            reach,
            reach - x_max,
        )

    def at(self, base_poses: Poses, room_m: FloatArray | float = 0.0) -> Rectangles:
        """The footprint at these base poses, with its front edge moved out by ``room_m``."""
        x, y, c, s = base_poses
        along = self.center_m[0] + 0.5 * room_m
        across = self.center_m[1]
        if np.ndim(along) or along != 0.0:
            x, y = np.asarray(x + along * c), np.asarray(y + along * s)
        if across != 0.0:
            x, y = np.asarray(x - across * s), np.asarray(y + across * c)
        half_length, half_width = self.half_size_m
        return Rectangles(Poses(x, y, c, s), half_length + 0.5 * room_m, half_width)


class Scene:
    """People and boxes around the robot, asked in the base frame of the instant of the plan.

    People are held as (P, 1, 1, 1) arrays, so that the gaps of (T, V, W) poses come out as
    (P, T, V, W).

    Args:
        robot_state: the base pose.
        constraints: the people.
        boxes_odom_m: (N, 4) x_min, y_min, x_max, y_max.
    """

    def __init__(
        self,
        robot_state: RobotState,
        constraints: NavConstraints,
        boxes_odom_m: FloatArray,
    ) -> None:
        self._boxes_odom_m = boxes_odom_m
        self.has_boxes = bool(len(boxes_odom_m))
        self.has_people = bool(constraints.obstacles)
        x0, y0 = robot_state.position_odom_m.tolist()
        c, s = math.cos(robot_state.heading_odom_rad), math.sin(robot_state.heading_odom_rad)
        self._base_odom = Poses(*(np.asarray(value) for value in (x0, y0, c, s)))
        self._rows: list[tuple[float, float, float, float]] = []
        self._radii = [person.radius_m for person in constraints.obstacles]
        for person in constraints.obstacles:
            x, y = person.center_odom_m.tolist()
            vx, vy = person.velocity_odom_mps.tolist()
            x, y = x - x0, y - y0
            self._rows.append((c * x + s * y, c * y - s * x, c * vx + s * vy, c * vy - s * vx))
        columns = np.array(self._rows, dtype=np.float64).reshape(-1, 4).T.reshape(4, -1, 1, 1, 1)
        self._x_m, self._y_m, self._vx_mps, self._vy_mps = columns
        self._radius_m = np.array(self._radii, dtype=np.float64).reshape(-1, 1, 1, 1)

    def standing_discs_m(
        self, speed_mps: float, margin_m: float
    ) -> list[tuple[float, float, float]]:
        """(x, y, radius + margin) of everyone slower than ``speed_mps``."""
        return [
            (x, y, radius + margin_m)
            for (x, y, vx, vy), radius in zip(self._rows, self._radii, strict=True)
            if vx * vx + vy * vy < speed_mps * speed_mps
        ]

    def people_gap_m(self, robot: Rectangles, t_s: FloatArray) -> FloatArray:
        """(P, T, V, W) gap between the robot and each person's disc, ``t_s`` from now."""
        return disc_gap_m(robot, *self._places_m(t_s), self._radius_m)

    def body_gap_m(self, robot: Rectangles, t_s: FloatArray, standing_mps: float) -> FloatArray:
        """(S, T, V, W) gap to the body of everyone slower than that whose disc the robot is not in.

        Walkers are passed by what they are about to use, see :meth:`strip_gap_m`; and who is in a
        disc has to get out of it first.
        """
        speed2 = self._vx_mps**2 + self._vy_mps**2
        apart_m = np.hypot(self._x_m, self._y_m) - self._radius_m - robot.half_width_m
        counts = ((speed2 < standing_mps**2) & (apart_m > 0.0)).ravel()
        x_m, y_m = self._places_m(t_s)
        return disc_gap_m(robot, x_m[counts], y_m[counts], np.asarray(BODY_RADIUS_M))

    def strip_gap_m(self, robot: Rectangles, t_s: FloatArray, ahead_s: float) -> FloatArray:
        """(P, T, V, W) gap to what each person's disc sweeps from ``t_s`` on for ``ahead_s``.

        The robot counts as a disc of half its width.
        """
        x_m, y_m = self._places_m(t_s)
        distance = strip_distance_m(
            robot.centers.x_m - x_m,
            robot.centers.y_m - y_m,
            self._vx_mps,
            self._vy_mps,
            ahead_s,
        )
        return np.asarray(distance - (self._radius_m + robot.half_width_m))

    def _places_m(self, t_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(P, T, 1, 1) x and y of everybody, ``t_s`` from now."""
        return self._x_m + self._vx_mps * t_s, self._y_m + self._vy_mps * t_s

    def box_gap_m(self, robot: Rectangles) -> FloatArray:
        """(T, V, W) gap between the robot and the nearest box, a lower bound."""
        centers_odom = robot.centers.seen_from(self._base_odom)
        return box_gap_m(robot._replace(centers=centers_odom), self._boxes_odom_m)
