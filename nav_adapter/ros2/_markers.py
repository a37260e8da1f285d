"""Markers for RViz."""

from __future__ import annotations

import math
from typing import Final

from perception.anthropometry import BODY_RADIUS_M

from .._constraints import NavConstraints
from .._robot import RobotState
from .conversions import header
from .messages.builtin_interfaces import Duration
from .messages.geometry_msgs import Point, Pose, Vector3
from .messages.std_msgs import ColorRGBA
from .messages.visualization_msgs import Marker, MarkerArray

# A marker disappears from the display after this time without an update.
_LIFETIME: Final = Duration(1, 0)
_STANDING_MPS: Final = 0.1
_LINE_M: Final = 0.04
_TEXT_M: Final = 0.25
_WHITE: Final = ColorRGBA(1.0, 1.0, 1.0, 1.0)


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
    shapes = [Marker(top, action=Marker.DELETEALL)]
    for each in constraints.obstacles:
        (x, y), (vx, vy) = each.center_odom_m.tolist(), each.velocity_odom_mps.tolist()
        color = awareness_color(each.awareness_lower)
        ring = [Point(u, v, 0.02) for u, v, *_ in each.polygon.exterior.coords]
        shapes.append(
            Marker(
                top,
                "body",
                each.track_id,
                Marker.CYLINDER,
                pose=Pose(Point(x, y, 0.5 * each.height_m)),
                scale=Vector3(2.0 * BODY_RADIUS_M, 2.0 * BODY_RADIUS_M, each.height_m),
                color=ColorRGBA(color.r, color.g, color.b, 0.6),
                lifetime=_LIFETIME,
            )
        )
        shapes.append(
            Marker(
                top,
                "obstacle",
                each.track_id,
                Marker.LINE_STRIP,
                scale=Vector3(_LINE_M, 0.0, 0.0),
                color=color,
                lifetime=_LIFETIME,
                points=tuple(ring),
            )
        )
        shapes.append(
            Marker(
                top,
                "awareness",
                each.track_id,
                Marker.TEXT_VIEW_FACING,
                pose=Pose(Point(x, y, each.height_m + _TEXT_M)),
                scale=Vector3(0.0, 0.0, _TEXT_M),
                color=_WHITE,
                lifetime=_LIFETIME,
                text=f"{each.track_id}: α ≥ {each.awareness_lower:.2f}",
            )
        )
        if math.hypot(vx, vy) > _STANDING_MPS:
            shapes.append(
                Marker(
                    top,
                    "velocity",
                    each.track_id,
                    Marker.ARROW,
                    scale=Vector3(0.06, 0.12, 0.15),
                    color=color,
                    lifetime=_LIFETIME,
                    points=(Point(x, y, 0.1), Point(x + vx, y + vy, 0.1)),
                )
            )
    if robot_state is not None:
        x, y = robot_state.position_odom_m.tolist()
        shapes.append(
            Marker(
                top,
                "limit",
                0,
                Marker.TEXT_VIEW_FACING,
                pose=Pose(Point(x, y, 2.0)),
                scale=Vector3(0.0, 0.0, _TEXT_M),
                color=_WHITE,
                lifetime=_LIFETIME,
                text=f"{constraints.speed_limit_mps:.2f} m/s: {constraints.limited_by}",
            )
        )
    return MarkerArray(tuple(shapes))


def awareness_color(awareness_lower: float) -> ColorRGBA:
    """Return a colour from red for 0 through yellow to green for 1."""
    return ColorRGBA(
        min(1.0, 2.0 - 2.0 * awareness_lower), min(1.0, 2.0 * awareness_lower), 0.1, 1.0
    )
