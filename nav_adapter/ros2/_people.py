"""People as messages of other ROS packages: obstacles, people, boxes, a grid, and markers."""

from __future__ import annotations

import math
import uuid
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

from .._checks import checked_square
from .._constraints import NavConstraints
from .._robot import RobotState
from ..exporters import boxes, paint_costmap
from .conversions import grid_of, header, yaw_quaternion
from .messages.builtin_interfaces import Duration
from .messages.costmap_converter_msgs import ObstacleArrayMsg, ObstacleMsg
from .messages.geometry_msgs import (
    Point,
    Point32,
    Polygon,
    Pose,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from .messages.nav2_msgs import CircleObject
from .messages.nav_msgs import OccupancyGrid
from .messages.people_msgs import People, Person
from .messages.std_msgs import ColorRGBA
from .messages.unique_identifier_msgs import UUID
from .messages.vision_msgs import (
    BoundingBox3D,
    Detection3D,
    Detection3DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
)
from .messages.visualization_msgs import Marker, MarkerArray

_OCCUPIED: Final = 100
# Any fixed namespace, so that a track has the same UUID in every process.
_NAMESPACE: Final = uuid.UUID("6f1b3f0a-6f53-4d5e-9c0e-5b2f3f8a7c11")
_RELIABILITY: Final = {"confirmed": 1.0, "coasting": 0.5, "tentative": 0.25}
# A marker disappears from the display after this time without an update.
_LIFETIME: Final = Duration(1, 0)
_STANDING_MPS: Final = 0.1
_LINE_M: Final = 0.04
# Width of shaft and head, and length of the head.
_ARROW_M: Final = (0.06, 0.12, 0.15)
_TEXT_M: Final = 0.25
_WHITE: Final = ColorRGBA(1.0, 1.0, 1.0, 1.0)


def circle_objects(
    constraints: NavConstraints, *, frame_id: str = "odom"
) -> tuple[CircleObject, ...]:
    """Return one ``nav2_msgs/CircleObject`` per person, filled and occupied.

    A track keeps its UUID, so that the vector-object server replaces its shape instead of adding
    another.
    """
    return tuple(
        CircleObject(
            header(constraints.stamp_s, frame_id),
            UUID(uuid.uuid5(_NAMESPACE, str(each.track_id)).bytes),
            Point32(*each.center_odom_m.tolist()),
            each.radius_m,
            True,
            _OCCUPIED,
        )
        for each in constraints.obstacles
    )


def teb_obstacles(constraints: NavConstraints, *, frame_id: str = "odom") -> ObstacleArrayMsg:
    """Return ``costmap_converter_msgs/ObstacleArrayMsg`` for TEB: moving circles.

    One corner and a radius is a circle. The velocity is in the frame of the header.
    """
    top = header(constraints.stamp_s, frame_id)
    obstacles = []
    for each in constraints.obstacles:
        (x, y), (vx, vy) = each.center_odom_m.tolist(), each.velocity_odom_mps.tolist()
        obstacles.append(
            ObstacleMsg(
                top,
                Polygon((Point32(x, y, 0.0),)),
                each.radius_m,
                each.track_id,
                velocities=TwistWithCovariance(Twist(Vector3(vx, vy, 0.0))),
            )
        )
    return ObstacleArrayMsg(top, tuple(obstacles))


def people(
    constraints: NavConstraints, tracks: Iterable[PersonTrack] = (), *, frame_id: str = "odom"
) -> People:
    """Return ``people_msgs/People`` with awareness and radius in the tags.

    Every person has the tags ``awareness_lower`` (the bound that was used) and ``radius_m``, and
    with a track also ``awareness``, ``awareness_std``, ``status`` and ``time_since_seen_s``. The
    ``reliability`` is 1 for a confirmed track, 0.5 for a coasting one, 0.25 for a tentative one,
    and 0 for a person without a track, whom the adapter still keeps.
    """
    by_id = {track.id: track for track in tracks}
    persons = []
    for each in constraints.obstacles:
        tags = {
            "awareness_lower": f"{each.awareness_lower:.3f}",
            "radius_m": f"{each.radius_m:.3f}",
        }
        track = by_id.get(each.track_id)
        if track is not None:
            tags |= {
                "awareness": f"{track.awareness:.3f}",
                "awareness_std": f"{track.awareness_std:.3f}",
                "status": track.status,
                "time_since_seen_s": f"{track.time_since_seen_s:.3f}",
            }
        persons.append(
            Person(
                str(each.track_id),
                Point(*each.center_odom_m.tolist()),
                Point(*each.velocity_odom_mps.tolist()),
                0.0 if track is None else _RELIABILITY[track.status],
                tuple(tags),
                tuple(tags.values()),
            )
        )
    return People(header(constraints.stamp_s, frame_id), tuple(persons))


def detections(constraints: NavConstraints, *, frame_id: str = "odom") -> Detection3DArray:
    """Return ``vision_msgs/Detection3DArray``: the paper's 3-D boxes, sized by awareness.

    Each has two hypotheses: ``"person"`` with score 1, and ``"aware_person"`` with the lower bound
    of α that was used.
    """
    top = header(constraints.stamp_s, frame_id)
    found = []
    for each, box in zip(constraints.obstacles, boxes(constraints).tolist(), strict=True):
        x, y, z, length, width, height, yaw = box
        pose = Pose(Point(x, y, z), yaw_quaternion(yaw))
        found.append(
            Detection3D(
                top,
                tuple(
                    ObjectHypothesisWithPose(
                        ObjectHypothesis(name, score), PoseWithCovariance(pose)
                    )
                    for name, score in (("person", 1.0), ("aware_person", each.awareness_lower))
                ),
                BoundingBox3D(pose, Vector3(length, width, height)),
                str(each.track_id),
            )
        )
    return Detection3DArray(top, tuple(found))


def occupancy_grid(
    constraints: NavConstraints,
    center_odom_m: Any,
    *,
    size_m: float = 10.0,
    resolution_m: float = 0.05,
    frame_id: str = "odom",
) -> OccupancyGrid:
    """Return ``nav_msgs/OccupancyGrid``: 100 inside the obstacles, 0 elsewhere.

    The grid is a square around ``center_odom_m``. Its corner is rounded to whole cells so that
    people do not smear when the grid moves. Costs around them are left to Nav2's inflation layer.

    Args:
        constraints: the people.
        center_odom_m: (2,), usually the robot.
        size_m: side of the square.
        resolution_m: side of a cell.
        frame_id: of the constraints.

    Raises:
        NavError: for numbers that are not finite or not positive, or over four million cells.
    """
    origin, cell, side = checked_square("grid", center_odom_m, size_m, resolution_m)
    costs = np.zeros((side, side), dtype=np.uint8)
    paint_costmap(costs, origin, cell, constraints, ring_m=0.0)
    cells = np.where(costs > 0, np.int8(_OCCUPIED), np.int8(0))
    return grid_of(constraints.stamp_s, frame_id, origin, cell, cells)


def markers(
    constraints: NavConstraints,
    robot_state: RobotState | None = None,
    *,
    frame_id: str = "odom",
) -> MarkerArray:
    """Return ``visualization_msgs/MarkerArray``: bodies, outlines, velocities, α and the limit.

    Bodies and outlines run from red (unaware) to green (aware). The first marker deletes the old
    ones. The limit and its reason are shown above the robot.
    """
    top = header(constraints.stamp_s, frame_id)

    def shape(
        name: str,
        number: int,
        kind: int,
        scale: tuple[float, float, float],
        color: ColorRGBA,
        **more: Any,
    ) -> Marker:
        size = Vector3(*scale)
        return Marker(top, name, number, kind, scale=size, color=color, lifetime=_LIFETIME, **more)

    def label(name: str, number: int, x: float, y: float, z: float, text: str) -> Marker:
        place, scale = Pose(Point(x, y, z)), (0.0, 0.0, _TEXT_M)
        return shape(name, number, Marker.TEXT_VIEW_FACING, scale, _WHITE, pose=place, text=text)

    shapes = [Marker(top, action=Marker.DELETEALL)]
    for each in constraints.obstacles:
        (x, y), (vx, vy) = each.center_odom_m.tolist(), each.velocity_odom_mps.tolist()
        number, color = each.track_id, awareness_color(each.awareness_lower)
        body = 2.0 * BODY_RADIUS_M, 2.0 * BODY_RADIUS_M, each.height_m
        middle = Pose(Point(x, y, 0.5 * each.height_m))
        pale = ColorRGBA(color.r, color.g, color.b, 0.6)
        ring = tuple(Point(u, v, 0.02) for u, v, *_ in each.polygon.exterior.coords)
        alpha = f"{number}: α ≥ {each.awareness_lower:.2f}"
        shapes += [
            shape("body", number, Marker.CYLINDER, body, pale, pose=middle),
            shape("obstacle", number, Marker.LINE_STRIP, (_LINE_M, 0.0, 0.0), color, points=ring),
            label("awareness", number, x, y, each.height_m + _TEXT_M, alpha),
        ]
        if math.hypot(vx, vy) > _STANDING_MPS:
            way = Point(x, y, 0.1), Point(x + vx, y + vy, 0.1)
            shapes.append(shape("velocity", number, Marker.ARROW, _ARROW_M, color, points=way))
    if robot_state is not None:
        x, y = robot_state.position_odom_m.tolist()
        limit = f"{constraints.speed_limit_mps:.2f} m/s: {constraints.limited_by}"
        shapes.append(label("limit", 0, x, y, 2.0, limit))
    return MarkerArray(tuple(shapes))


def awareness_color(awareness_lower: float) -> ColorRGBA:
    """Return a colour from red for 0 through yellow to green for 1."""
    return ColorRGBA(
        min(1.0, 2.0 - 2.0 * awareness_lower), min(1.0, 2.0 * awareness_lower), 0.1, 1.0
    )
