"""People, boxes and the goal around the robot at the time of a plan, and what they call for.

A robot that slows down only when it is near a crossing person makes both hesitate. The person waits
for the robot, which then waits for the person. A robot that slows down early is there when they
have passed (:func:`giving_way_mps`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from nav_adapter import NavConstraints, RobotState
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._geometry import Box, FootprintBox, Poses, Rectangles, box_gap_m, disc_gap_m, strip_distance_m

#: The robot at its present place.
STANDING: Final = Poses(*(np.asarray(value) for value in (0.0, 0.0, 1.0, 0.0)))
# The robot passes on the left only if that turn is smaller by this much; else it keeps right.
_KEEP_RIGHT_RAD: Final = 0.1
# The place of a person: their body and some room. It does not grow with unawareness as obstacles
# do, because a body that has left the way has left it.
_PLACE_M: Final = BODY_RADIUS_M + 0.20
# Whoever enters the way this much later than the robot has left the place is passed in front of.
_SPARE_S: Final = 0.5
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


class Disc(NamedTuple):
    """A person as a disc in the base frame: place (m), velocity (m/s) and radius (m)."""

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    radius_m: float

    @property
    def speed2_m2ps2(self) -> float:
        """The square of the speed."""
        return self.vx_mps * self.vx_mps + self.vy_mps * self.vy_mps

    def nearest_m(self, horizon_s: float) -> float:
        """Return the least distance of the centre from the origin, at constant velocity."""
        x, y, vx, vy, _ = self
        at_s = min(max(-(x * vx + y * vy) / max(self.speed2_m2ps2, 1e-12), 0.0), horizon_s)
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
        """Return the scene without people and boxes that no robot at some poses comes near to.

        Args:
            poses: of the base.
            margin_m: everybody and everything nearer to one of the poses stays.
            horizon_s: time over which people go on at constant velocity.
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

    def without_people(self) -> Scene:
        """Return the same boxes around the robot, and nobody."""
        return replace(self, people=())

    def people_gap_m(self, robot: Rectangles, t_s: FloatArray) -> FloatArray:
        """Return the gap (P, T, V, W) from the robot to each person's disc, ``t_s`` from now."""
        x_m, y_m, vx_mps, vy_mps, radius_m = self._columns
        return disc_gap_m(robot, x_m + vx_mps * t_s, y_m + vy_mps * t_s, radius_m)

    def strip_gap_m(self, robot: Rectangles, t_s: FloatArray, ahead_s: float) -> FloatArray:
        """Return the gap (P, T, V, W) to the area that each person's disc sweeps in ``ahead_s``.

        The sweep begins at ``t_s`` from now. The robot counts as a disc of half its width.
        """
        x_m, y_m, vx_mps, vy_mps, radius_m = self._columns
        rel_x = robot.centers.x_m - (x_m + vx_mps * t_s)
        rel_y = robot.centers.y_m - (y_m + vy_mps * t_s)
        distance = strip_distance_m(rel_x, rel_y, vx_mps, vy_mps, ahead_s)
        return np.asarray(distance - (radius_m + robot.half_width_m))

    def standing(self, standing_mps: float, half_width_m: float) -> Scene:
        """Return the bodies of people slower than ``standing_mps``, without the boxes.

        People whose disc contains a robot of that half width are left out, because the robot has
        to leave the disc first.
        """
        bodies = tuple(
            person._replace(radius_m=BODY_RADIUS_M)
            for person in self.people
            if person.speed2_m2ps2 < standing_mps * standing_mps
            and math.hypot(person.x_m, person.y_m) - person.radius_m - half_width_m > 0.0
        )
        return replace(self, people=bodies, boxes_odom_m=())

    def box_gap_m(self, robot: Rectangles) -> FloatArray:
        """Return a lower bound (T, V, W) of the gap between the robot and the nearest box."""
        centers_odom = robot.centers.transformed(self.base_odom)
        return box_gap_m(robot._replace(centers=centers_odom), self.boxes_odom_m)

    @cached_property
    def _columns(self) -> FloatArray:
        """Places, velocities and radii (5, P, 1, 1, 1)."""
        columns = np.array(self.people, dtype=np.float64).T
        return np.asarray(columns.reshape(5, -1, 1, 1, 1))


def past_standing(
    goal: Aim,
    scene: Scene,
    footprint: FootprintBox,
    *,
    clearance_m: float,
    margin_m: float,
    standing_mps: float,
) -> Aim:
    """Return the goal, or the way past a person who stands in front of it.

    Args:
        goal: the goal.
        scene: people and boxes.
        footprint: of the robot.
        clearance_m: gap to boxes beside the person.
        margin_m: of the way past, beyond half the robot's width and the clearance.
        standing_mps: people below this speed stand.
    """
    margin_m = footprint.half_size_m[1] + clearance_m + margin_m
    discs = [
        (person.x_m, person.y_m, person.radius_m + margin_m)
        for person in scene.people
        if person.speed2_m2ps2 < standing_mps * standing_mps
    ]
    if not discs:
        return goal
    c, s = math.cos(goal.bearing_rad), math.sin(goal.bearing_rad)

    def is_free(x_m: float, y_m: float) -> bool:
        pose = Poses(*(np.asarray(value) for value in (x_m, y_m, c, s)))
        return bool(scene.box_gap_m(footprint.at(pose)) >= clearance_m)

    bearing_rad = detour_bearing_rad(goal.bearing_rad, goal.distance_m, discs, is_free)
    return Aim(goal.distance_m, bearing_rad)


def detour_bearing_rad(
    goal_bearing_rad: float,
    goal_distance_m: float,
    discs_m: Sequence[tuple[float, float, float]],
    is_free: Callable[[float, float], bool],
) -> float:
    """Return the bearing of the goal, or of the tangent past the nearest disc that hides the goal.

    Sampled motions of a few seconds do not find the way around an obstacle right ahead; the tangent
    of a visibility graph does. If both sides are blocked, the bearing stays that of the goal and
    the robot waits.

    Args:
        goal_bearing_rad: bearing of the goal in the base frame.
        goal_distance_m: distance of the goal; discs beyond it do not hide it.
        discs_m: (x, y, radius) in the base frame; the radius includes the robot's half width.
        is_free: whether the robot at (x, y) m is clear of boxes, on its way to the goal.
    """
    for x, y, radius in sorted(discs_m, key=lambda disc: math.hypot(disc[0], disc[1]) - disc[2]):
        distance = math.hypot(x, y)
        if distance >= goal_distance_m or distance < 1e-9:
            continue
        # Inside a disc the direction out is perpendicular to its centre.
        half_angle = math.asin(min(1.0, radius / distance))
        to_left = math.remainder(math.atan2(y, x) - goal_bearing_rad, math.tau) + half_angle
        to_right = 2.0 * half_angle - to_left
        if to_left <= 0.0 or to_right <= 0.0:
            continue
        # The narrowest place is beside the person, perpendicular to the direction of the goal.
        beside = radius * math.cos(goal_bearing_rad), radius * math.sin(goal_bearing_rad)
        left = goal_bearing_rad + to_left, (x - beside[1], y + beside[0])
        right = goal_bearing_rad - to_right, (x + beside[1], y - beside[0])
        sides = (left, right) if to_left < to_right - _KEEP_RIGHT_RAD else (right, left)
        return next((bearing for bearing, place in sides if is_free(*place)), goal_bearing_rad)
    return goal_bearing_rad


@dataclass(frozen=True, slots=True)
class Way:
    """The strip that the robot drives through on its course, from its base origin.

    Attributes:
        bearing_rad: course in the base frame.
        length_m: length of the strip beyond the robot's front edge.
        half_width_m: half its width.
        front_m: from the base origin to the front edge of the robot.
        rear_m: from the base origin back to its rear edge.
    """

    bearing_rad: float
    length_m: float
    half_width_m: float
    front_m: float
    rear_m: float


def giving_way_mps(
    way: Way,
    people: Iterable[Sequence[float]],
    top_mps: float,
    *,
    crossing_mps: float,
    within_s: float,
) -> float:
    """Return the highest speed, up to ``top_mps``, that lets crossing people pass first.

    At this speed the robot's front edge is before the place of each person, a disc of 0.5 m, for as
    long as that is in the way, if everybody goes on at constant velocity.

    Args:
        way: of the robot.
        people: x, y, vx, vy of each, in the base frame.
        top_mps: speed of the robot otherwise, > 0.
        crossing_mps: people who are slower than this across the way do not count, since they may
            be waiting for the robot.
        within_s: people who enter the way later do not count.
    """
    c, s = math.cos(way.bearing_rad), math.sin(way.bearing_rad)
    speed_mps = top_mps
    for x, y, vx, vy, *_ in people:
        along_m, across_m = c * x + s * y, c * y - s * x
        along_mps, across_mps = c * vx + s * vy, c * vy - s * vx
        if abs(across_mps) < crossing_mps:
            continue
        half_m = math.copysign(way.half_width_m + _PLACE_M, across_mps)
        enters_s = max((-half_m - across_m) / across_mps, 0.0)
        leaves_s = (half_m - across_m) / across_mps
        if leaves_s <= 0.0 or enters_s > within_s:
            continue
        ends_m = (along_m + along_mps * enters_s, along_m + along_mps * leaves_s)
        room_m = min(ends_m) - _PLACE_M - way.front_m
        if not 0.0 < room_m < way.length_m:
            continue  # beside or behind the robot, or beyond its goal
        passed_m = max(ends_m) + _PLACE_M + way.rear_m
        if passed_m / top_mps + _SPARE_S > enters_s:
            speed_mps = min(speed_mps, room_m / leaves_s)
    return speed_mps
