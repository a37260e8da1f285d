"""Polygons for Nav2's collision monitor."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from shapely.geometry import MultiPoint, Polygon

from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._robot import RobotProfile, RobotState
from ._speed_limit import SLOWEST_MPS
from ._stamps import header
from .messages.geometry_msgs import Point32, PolygonInstance, PolygonInstanceStamped, PolygonStamped
from .messages.geometry_msgs import Polygon as PolygonMessage

#: Id of the polygon that stops the robot; tracks have ids from 0.
STOP_POLYGON_ID: Final = -1
# A point on the border of a zone may count as outside of it.
_WITHIN: Final = 0.8
# Where that polygon waits: behind every zone around a robot, near enough for single precision.
_PARKED_M: Final = 1000.0


def collision_polygons(
    constraints: NavConstraints,
    robot: RobotProfile,
    robot_state: RobotState | None,
    *,
    odom_frame: str = "odom",
    base_frame: str = "base_link",
) -> tuple[PolygonInstanceStamped, ...]:
    """``geometry_msgs/PolygonInstanceStamped`` for a polygon source of the collision monitor.

    One a person, and last the stop polygon, always and under the same id: a little less than the
    robot's own footprint when the limit is below what :func:`speed_limit` can send, so that it lies
    within every stop zone, and a copy a kilometre behind the robot otherwise. That keeps the source
    alive while nobody is there (the monitor stops for a source that is silent), and silent is what
    it is when this process dies.

    People come farthest first: the monitor's reader queues no more than a few messages and drops
    the oldest, so that what is lost in a crowd is far away.

    Args:
        constraints: people and limit.
        robot: its footprint.
        robot_state: to order people by distance; None leaves their order.
        odom_frame: frame of the people.
        base_frame: frame of the footprint.
    """
    obstacles = list(constraints.obstacles)
    if robot_state is not None:
        place = robot_state.position_odom_m
        obstacles.sort(
            key=lambda each: each.radius_m - float(np.linalg.norm(each.center_odom_m - place))
        )
    people = [
        _instance(each.polygon, each.track_id, constraints.stamp_s, odom_frame)
        for each in obstacles
    ]
    corners = _within_footprint(robot)
    if constraints.speed_limit_mps >= SLOWEST_MPS:
        corners = corners - np.array([_PARKED_M, 0.0])
    stop = _instance(Polygon(corners), STOP_POLYGON_ID, constraints.stamp_s, base_frame)
    return (*people, stop)


def stop_zone(
    robot: RobotProfile,
    speed_mps: float,
    stamp_s: float,
    *,
    base_frame: str = "base_link",
) -> PolygonStamped:
    """``geometry_msgs/PolygonStamped``: where a robot that brakes now will still come.

    The footprint, drawn out along the direction of travel by reaction and braking distance
    v·T + v²/2a (decision 8 without the person): a stop zone for the collision monitor's
    ``polygon_sub_topic`` that grows with speed.
    """
    reach = abs(speed_mps) * robot.reaction_time_s + speed_mps**2 / (
        2.0 * robot.max_deceleration_mps2
    )
    footprint = np.asarray(robot.footprint_m)
    ahead = footprint + np.array([math.copysign(reach, speed_mps), 0.0])
    zone = MultiPoint(np.concatenate([footprint, ahead])).convex_hull
    return PolygonStamped(header(stamp_s, base_frame), _polygon(zone))


def _within_footprint(robot: RobotProfile) -> FloatArray:
    hull = MultiPoint(robot.footprint_m).convex_hull
    middle = np.array(hull.centroid.coords[0])
    corners = np.asarray(hull.exterior.coords)[:-1]
    return np.asarray(middle + _WITHIN * (corners - middle), dtype=np.float64)


def _instance(
    shape: Polygon, identity: int, stamp_s: float, frame_id: str
) -> PolygonInstanceStamped:
    return PolygonInstanceStamped(
        header(stamp_s, frame_id), PolygonInstance(_polygon(shape), identity)
    )


def _polygon(shape: Any) -> PolygonMessage:
    """Without the repeated last corner of shapely."""
    ring = np.asarray(shape.exterior.coords)[:-1, :2]
    return PolygonMessage(tuple(Point32(x, y, 0.0) for x, y in ring.tolist()))
