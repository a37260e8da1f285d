"""People and boxes around the robot at the time of a plan, and the place to head for."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from nav_adapter import NavConstraints, RobotState
from perception.arrays import FloatArray

from ._geometry import Box, Poses, Rectangles, box_gap_m, disc_gap_m

#: The robot at its present place.
STANDING: Final = Poses(*(np.asarray(value) for value in (0.0, 0.0, 1.0, 0.0)))
# Added to the distances from which on people and boxes do not count, against rounding.
_FAR_M: Final = 0.01


@dataclass(frozen=True, slots=True)
class Aim:
    """The place that a plan heads for.

    Attributes:
        distance_m: distance to the goal.
        bearing_rad: direction to head for, in the base frame.
    """

    distance_m: float
    bearing_rad: float

    @classmethod
    def at(cls, place_odom_m: FloatArray, state: RobotState) -> Aim:
        """Return the aim at a place; one straight behind always has the bearing −π."""
        x, y = (place_odom_m - state.position_odom_m).tolist()
        c, s = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
        forward_m, left_m = c * x + s * y, c * y - s * x
        bearing_rad = math.atan2(left_m, forward_m)
        if bearing_rad > math.pi - 1e-6:  # else rounding would choose the side to turn to
            bearing_rad -= math.tau
        return cls(math.hypot(forward_m, left_m), bearing_rad)

    def from_poses_m(self, poses: Poses) -> tuple[FloatArray, FloatArray]:
        """Return the way from poses of the base to the place, along x and y of its present one."""
        return (
            self.distance_m * math.cos(self.bearing_rad) - poses.x_m,
            self.distance_m * math.sin(self.bearing_rad) - poses.y_m,
        )


class Disc(NamedTuple):
    """A person as a disc in the base frame: place (m), velocity (m/s) and radius (m)."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    radius_m: float

    def nearest_m(self, horizon_s: float) -> float:
        """Return the least distance of the centre from the origin, at constant velocity."""
        x, y, vx, vy, _ = self
        at_s = min(max(-(x * vx + y * vy) / max(vx * vx + vy * vy, 1e-12), 0.0), horizon_s)
        return math.hypot(x + vx * at_s, y + vy * at_s)


@dataclass(frozen=True, eq=False)
class Scene:
    """People and boxes around the robot at the time of the plan.

    Gaps to people are arrays (P, T, V, W) for poses (T, V, W).

    Attributes:
        base_odom: pose of the base.
        people: in the base frame.
        boxes_odom_m: the boxes, in odom.
    """

    base_odom: Poses
    people: tuple[Disc, ...]
    boxes_odom_m: tuple[Box, ...]

    @classmethod
    def around(
        cls, state: RobotState, constraints: NavConstraints, boxes_odom_m: tuple[Box, ...]
    ) -> Scene:
        """Return the people of ``constraints`` and the boxes around a robot."""
        x0, y0 = state.position_odom_m.tolist()
        c, s = math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)
        people = []
        for person in constraints.obstacles:
            x, y = person.center_odom_m.tolist()
            vx, vy = person.velocity_odom_mps.tolist()
            x, y = x - x0, y - y0
            place, velocity = (c * x + s * y, c * y - s * x), (c * vx + s * vy, c * vy - s * vx)
            people.append(Disc(*place, *velocity, person.radius_m))
        base = Poses(*(np.asarray(value) for value in (x0, y0, c, s)))
        return cls(base, tuple(people), boxes_odom_m)

    def near(self, poses: Poses, margin_m: float, horizon_s: float) -> Scene:
        """Return the people and boxes that a robot at some poses may come nearer to than a margin.

        People go on at constant velocity for ``horizon_s``.
        """
        distance_m = float(np.abs(poses.x_m).max() + np.abs(poses.y_m).max()) + margin_m + _FAR_M
        x_m, y_m = float(self.base_odom.x_m), float(self.base_odom.y_m)
        return replace(
            self,
            people=tuple(
                person
                for person in self.people
                if person.nearest_m(horizon_s) < distance_m + person.radius_m
            ),
            boxes_odom_m=tuple(
                box
                for box in self.boxes_odom_m
                if max(box[0] - x_m, x_m - box[2], box[1] - y_m, y_m - box[3]) < distance_m
            ),
        )

    def within(self, radius_m: float) -> Scene:
        """Return the scene with nobody's disc larger than a radius."""
        people = (each._replace(radius_m=min(each.radius_m, radius_m)) for each in self.people)
        return replace(self, people=tuple(people))

    def people_gap_m(self, robot: Rectangles, t_s: FloatArray) -> FloatArray:
        """Return the gap (P, T, V, W) from the robot to each person's disc, ``t_s`` from now."""
        x_m, y_m, vx_mps, vy_mps, radius_m = self._columns
        return disc_gap_m(robot, x_m + vx_mps * t_s, y_m + vy_mps * t_s, radius_m)

    def box_gap_m(self, robot: Rectangles) -> FloatArray:
        """Return a lower bound (T, V, W) of the gap between the robot and the nearest box."""
        centers_odom = robot.centers.transformed(self.base_odom)
        return box_gap_m(robot._replace(centers=centers_odom), self.boxes_odom_m)

    @cached_property
    def _columns(self) -> FloatArray:
        """Places, velocities and radii (5, P, 1, 1, 1)."""
        columns = np.array(self.people, dtype=np.float64).T
        return np.asarray(columns.reshape(5, -1, 1, 1, 1))
