"""Polygons for Nav2's collision monitor."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from shapely.geometry import MultiPoint, Polygon

from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._robot import RobotProfile, RobotState
from ..rigid import Motion
from ._speed_limit import SLOWEST_MPS, controller_limit_mps
from .conversions import header
from .messages.geometry_msgs import Point32, PolygonInstance, PolygonInstanceStamped, PolygonStamped
from .messages.geometry_msgs import Polygon as PolygonMessage

#: Id of the polygon that stops the robot; tracks have ids from 0.
STOP_POLYGON_ID: Final = -1
# The stop polygon is smaller than the footprint, since points on a zone's border may be outside.
_STOP_POLYGON_SCALE: Final = 0.8
# Distance of that polygon while the robot may move: outside every zone around the robot, but near
# enough for single precision.
_PARKED_M: Final = 1000.0


def collision_polygons(
    constraints: NavConstraints,
    robot: RobotProfile,
    robot_state: RobotState | None,
    *,
    odom_frame: str = "odom",
    base_frame: str = "base_link",
) -> tuple[PolygonInstanceStamped, ...]:
    """Return ``geometry_msgs/PolygonInstanceStamped``, a polygon source for the collision monitor.

    There is one per person, and last the stop polygon, which is always sent and keeps its id. If
    the limit is below what :func:`speed_limit` can send, it is a little smaller than the robot's
    footprint, so that it lies within every stop zone. Otherwise it is a kilometre behind the robot.
    It keeps the source alive while nobody is there: the monitor stops for a silent source, and the
    source is silent if this process ends.

    The farthest people come first: the monitor queues only a few messages and drops the oldest, so
    in a crowd it loses the farthest people.

    Args:
        constraints: people and limit.
        robot: the robot, for its footprint.
        robot_state: to order people by distance, and for its curve (:func:`speed_limit`).
        odom_frame: frame of the people.
        base_frame: frame of the footprint.
    """
    obstacles = list(constraints.obstacles)
    if robot_state is not None:
        robot_m = robot_state.position_odom_m
        obstacles.sort(
            key=lambda each: each.radius_m - float(np.linalg.norm(each.center_odom_m - robot_m))
        )
    people = [
        _instance(each.polygon, each.track_id, constraints.stamp_s, odom_frame)
        for each in obstacles
    ]
    corners = _within_footprint(robot)
    if controller_limit_mps(constraints, robot_state) >= SLOWEST_MPS:
        corners = corners - np.array([_PARKED_M, 0.0])
    stop = _instance(Polygon(corners), STOP_POLYGON_ID, constraints.stamp_s, base_frame)
    return (*people, stop)


def stop_zone(
    robot: RobotProfile,
    speed_mps: float,
    stamp_s: float,
    *,
    lateral_mps: float = 0.0,
    yaw_rate_radps: float = 0.0,
    base_frame: str = "base_link",
) -> PolygonStamped:
    """Return ``geometry_msgs/PolygonStamped``: the area that a robot passes when it brakes now.

    It is the convex hull of the footprint all along the robot's curve, as far as the stopping
    distance v·T + v²/2a (speed and separation without the person): a stop zone that grows with
    speed, for the collision monitor's ``polygon_sub_topic``. ``lateral_mps`` is the speed to the
    left, and ``yaw_rate_radps`` bends the zone.
    """
    motion = Motion(0.0, 0.0, 0.0, speed_mps, lateral_mps, yaw_rate_radps)
    stopping_s = motion.stopping_s(
        robot.reaction_time_s, robot.max_deceleration_mps2, robot.circumscribed_radius_m
    )
    places, bulge_m = motion.swept(robot.footprint_m.tolist(), stopping_s)
    zone = MultiPoint(places).convex_hull.buffer(bulge_m, join_style="mitre")
    return PolygonStamped(header(stamp_s, base_frame), _polygon(zone))


def _within_footprint(robot: RobotProfile) -> FloatArray:
    """Return the corners (M, 2) of the footprint's hull, scaled about its centroid."""
    hull = MultiPoint(robot.footprint_m).convex_hull
    middle = np.array(hull.centroid.coords[0])
    corners = np.asarray(hull.exterior.coords)[:-1]
    return np.asarray(middle + _STOP_POLYGON_SCALE * (corners - middle), dtype=np.float64)


def _instance(
    shape: Polygon, identity: int, stamp_s: float, frame_id: str
) -> PolygonInstanceStamped:
    return PolygonInstanceStamped(
        header(stamp_s, frame_id), PolygonInstance(_polygon(shape), identity)
    )


def _polygon(shape: Any) -> PolygonMessage:
    """Return a shapely polygon as a message, without the repeated last corner."""
    ring = np.asarray(shape.exterior.coords)[:-1, :2]
    return PolygonMessage(tuple(Point32(x, y, 0.0) for x, y in ring.tolist()))
