"""People and boxes around the robot at the time of a plan, and the gaps from many poses to them."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._rollout import Poses


class Rectangles(NamedTuple):
    """Rectangles of the same width at many poses.

    Attributes:
        centers: poses of the centres, heading along the length.
        half_length_m: one number, or one per pose.
        half_width_m: one number.
    """

    centers: Poses
    half_length_m: FloatArray | float
    half_width_m: float


def disc_gap_m(
    rectangles: Rectangles,
    x_m: FloatArray,
    y_m: FloatArray,
    radius_m: FloatArray,
) -> FloatArray:
    """Return the distance from rectangles to discs; negative where they overlap.

    Exact while the disc's centre is outside the rectangle; inside, minus the radius.

    Args:
        rectangles: the rectangles.
        x_m: disc centres in the frame of the rectangles, broadcast against their poses.
        y_m: disc centres, the same along y.
        radius_m: radii of the discs.
    """
    centers, half_length, half_width = rectangles
    c, s = centers.cos_heading, centers.sin_heading
    rel_x, rel_y = centers.x_m - x_m, centers.y_m - y_m
    along = np.maximum(np.abs(rel_x * c + rel_y * s) - half_length, 0.0)
    across = np.maximum(np.abs(rel_y * c - rel_x * s) - half_width, 0.0)
    return np.asarray(np.sqrt(along * along + across * across) - radius_m)


def strip_distance_m(
    rel_x_m: FloatArray,
    rel_y_m: FloatArray,
    velocity_x_mps: FloatArray,
    velocity_y_mps: FloatArray,
    ahead_s: float,
) -> FloatArray:
    """Return the distance from points to the segments that people walk in the next ``ahead_s``.

    ``rel_x_m`` and ``rel_y_m`` are point minus person. The segment of a standing person is a point.
    """
    speed2 = velocity_x_mps * velocity_x_mps + velocity_y_mps * velocity_y_mps
    inverse = 1.0 / np.maximum(speed2, 1e-12)
    along_s = rel_x_m * (velocity_x_mps * inverse) + rel_y_m * (velocity_y_mps * inverse)
    along_s = np.minimum(np.maximum(along_s, 0.0), ahead_s)
    off_x = rel_x_m - velocity_x_mps * along_s
    off_y = rel_y_m - velocity_y_mps * along_s
    return np.asarray(np.sqrt(off_x * off_x + off_y * off_y))


def box_gap_m(rectangles: Rectangles, boxes_m: FloatArray) -> FloatArray:
    """Return a lower bound of the distance from rectangles to the nearest axis-aligned box.

    A rectangle counts with its axis-aligned bounding box, and a diagonal gap with its larger
    component: exact along a wall, below the true distance at a corner. Negative where the bounding
    box overlaps a box; infinite without boxes.

    Args:
        rectangles: in the frame of the boxes.
        boxes_m: (N, 4) x_min, y_min, x_max, y_max.
    """
    centers, half_length, half_width = rectangles
    cos_abs, sin_abs = np.abs(centers.cos_heading), np.abs(centers.sin_heading)
    extent_x = half_length * cos_abs + half_width * sin_abs
    extent_y = half_length * sin_abs + half_width * cos_abs
    x_low, x_high = centers.x_m - extent_x, centers.x_m + extent_x
    y_low, y_high = centers.y_m - extent_y, centers.y_m + extent_y
    nearest = np.full(np.shape(x_low), np.inf)
    gap, other = np.empty_like(nearest), np.empty_like(nearest)
    for x_min, y_min, x_max, y_max in boxes_m.tolist():
        np.subtract(x_min, x_high, out=gap)
        np.maximum(gap, np.subtract(x_low, x_max, out=other), out=gap)
        np.maximum(gap, np.subtract(y_min, y_high, out=other), out=gap)
        np.maximum(gap, np.subtract(y_low, y_max, out=other), out=gap)
        np.minimum(nearest, gap, out=nearest)
    return nearest


@dataclass(frozen=True, slots=True, eq=False)
class FootprintBox:
    """The bounding rectangle of a robot's outline, along its axes.

    Attributes:
        center_m: (x, y) in the base frame.
        half_size_m: half the length and half the width.
        reach_m: distance from the base origin to the farthest corner.
        turning_margin_m: distance by which the circle of that radius exceeds the front edge.
    """

    center_m: tuple[float, float]
    half_size_m: tuple[float, float]
    reach_m: float
    turning_margin_m: float

    @classmethod
    def of(cls, robot: RobotProfile) -> FootprintBox:
        """Return the box of ``robot``."""
        x_min, y_min = robot.footprint_m.min(axis=0).tolist()
        x_max, y_max = robot.footprint_m.max(axis=0).tolist()
        reach = math.hypot(max(-x_min, x_max), max(-y_min, y_max))
        return cls(
            (0.5 * (x_min + x_max), 0.5 * (y_min + y_max)),
            (0.5 * (x_max - x_min), 0.5 * (y_max - y_min)),
            reach,
            reach - x_max,
        )

    def at(self, base_poses: Poses, front_margin_m: FloatArray | float = 0.0) -> Rectangles:
        """Return the footprint at base poses, with its front edge moved out by a margin."""
        x, y, c, s = base_poses
        along = self.center_m[0] + 0.5 * front_margin_m
        across = self.center_m[1]
        if np.ndim(along) or along != 0.0:
            x, y = np.asarray(x + along * c), np.asarray(y + along * s)
        if across != 0.0:
            x, y = np.asarray(x - across * s), np.asarray(y + across * c)
        half_length, half_width = self.half_size_m
        return Rectangles(Poses(x, y, c, s), half_length + 0.5 * front_margin_m, half_width)


class Scene:
    """People and boxes around the robot, in the base frame at the time of the plan.

    People are (P, 1, 1, 1) arrays, so that the gaps of (T, V, W) poses are (P, T, V, W).

    Args:
        robot_state: pose of the base.
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
        self._people: list[tuple[float, float, float, float]] = []
        self._radii = [person.radius_m for person in constraints.obstacles]
        for person in constraints.obstacles:
            x, y = person.center_odom_m.tolist()
            vx, vy = person.velocity_odom_mps.tolist()
            x, y = x - x0, y - y0
            self._people.append((c * x + s * y, c * y - s * x, c * vx + s * vy, c * vy - s * vx))
        columns = np.array(self._people, dtype=np.float64).reshape(-1, 4).T.reshape(4, -1, 1, 1, 1)
        self._x_m, self._y_m, self._vx_mps, self._vy_mps = columns
        self._radius_m = np.array(self._radii, dtype=np.float64).reshape(-1, 1, 1, 1)

    def within(self, distance_m: float, horizon_s: float) -> Scene:
        """Return the scene without the people and boxes that stay away from the base.

        Args:
            distance_m: no disc of a person left out comes nearer to the present base origin, and no
                box left out is nearer along x or y.
            horizon_s: time over which people go on at constant velocity.
        """
        near = copy.copy(self)
        rows = [
            row
            for row, (person, radius) in enumerate(zip(self._people, self._radii, strict=True))
            if _nearest_m(*person, horizon_s) < distance_m + radius
        ]
        if len(rows) < len(self._people):
            near._people = [self._people[row] for row in rows]
            near._radii = [self._radii[row] for row in rows]
            near._x_m, near._y_m = self._x_m[rows], self._y_m[rows]
            near._vx_mps, near._vy_mps = self._vx_mps[rows], self._vy_mps[rows]
            near._radius_m = self._radius_m[rows]
            near.has_people = self.has_people and bool(rows)
        if self.has_boxes:
            x_m, y_m = float(self._base_odom.x_m), float(self._base_odom.y_m)
            near._boxes_odom_m = np.array(
                [
                    box
                    for box in self._boxes_odom_m.tolist()
                    if max(box[0] - x_m, x_m - box[2], box[1] - y_m, y_m - box[3]) < distance_m
                ]
            ).reshape(-1, 4)
            near.has_boxes = bool(len(near._boxes_odom_m))
        return near

    @property
    def people(self) -> Sequence[tuple[float, float, float, float]]:
        """Return x, y, vx, vy of each person."""
        return self._people

    def among(self, boxes_odom_m: FloatArray) -> Scene:
        """Return the same people among other boxes (N, 4)."""
        other = copy.copy(self)
        other._boxes_odom_m, other.has_boxes = boxes_odom_m, bool(len(boxes_odom_m))
        return other

    def without_people(self) -> Scene:
        """Return the same boxes around the robot, and nobody."""
        alone = copy.copy(self)
        alone.has_people = False
        return alone

    def standing_discs_m(
        self, speed_mps: float, margin_m: float
    ) -> list[tuple[float, float, float]]:
        """Return (x, y, radius + margin) of all people slower than ``speed_mps``."""
        return [
            (x, y, radius + margin_m)
            for (x, y, vx, vy), radius in zip(self._people, self._radii, strict=True)
            if vx * vx + vy * vy < speed_mps * speed_mps
        ]

    def people_gap_m(self, robot: Rectangles, t_s: FloatArray) -> FloatArray:
        """Return the gap (P, T, V, W) from the robot to each person's disc, ``t_s`` from now."""
        return disc_gap_m(robot, *self._places_m(t_s), self._radius_m)

    def body_gap_m(self, robot: Rectangles, t_s: FloatArray, standing_mps: float) -> FloatArray:
        """Return the gap (S, T, V, W) to the body of each standing person.

        Standing people are slower than ``standing_mps``. People whose disc contains the robot are
        left out, because the robot has to leave the disc first. For walking people see
        :meth:`strip_gap_m`.
        """
        speed2 = self._vx_mps**2 + self._vy_mps**2
        apart_m = np.hypot(self._x_m, self._y_m) - self._radius_m - robot.half_width_m
        counts = ((speed2 < standing_mps**2) & (apart_m > 0.0)).ravel()
        x_m, y_m = self._places_m(t_s)
        return disc_gap_m(robot, x_m[counts], y_m[counts], np.asarray(BODY_RADIUS_M))

    def strip_gap_m(self, robot: Rectangles, t_s: FloatArray, ahead_s: float) -> FloatArray:
        """Return the gap (P, T, V, W) to the area that each person's disc sweeps in ``ahead_s``.

        The sweep begins at ``t_s`` from now. The robot counts as a disc of half its width.
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
        """Return x and y (P, T, 1, 1) of all people, ``t_s`` from now."""
        return self._x_m + self._vx_mps * t_s, self._y_m + self._vy_mps * t_s

    def box_gap_m(self, robot: Rectangles) -> FloatArray:
        """Return a lower bound (T, V, W) of the gap between the robot and the nearest box."""
        centers_odom = robot.centers.transformed(self._base_odom)
        return box_gap_m(robot._replace(centers=centers_odom), self._boxes_odom_m)


def _nearest_m(x_m: float, y_m: float, vx_mps: float, vy_mps: float, horizon_s: float) -> float:
    """Return the least distance from the origin of somebody who goes on at constant velocity."""
    speed2 = vx_mps * vx_mps + vy_mps * vy_mps
    at_s = min(max(-(x_m * vx_mps + y_m * vy_mps) / max(speed2, 1e-12), 0.0), horizon_s)
    return math.hypot(x_m + vx_mps * at_s, y_m + vy_mps * at_s)
