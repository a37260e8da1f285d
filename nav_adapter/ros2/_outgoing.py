"""All messages for one update, by topic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from tracking import PersonTrack

from .._constraints import NavConstraints
from .._robot import RobotProfile, RobotState
from ..rigid import Motion
from ._alerts import alerts
from ._people import circle_objects, detections, markers, occupancy_grid, people, teb_obstacles
from ._polygons import collision_polygons, stop_zone
from ._speed_limit import speed_limit
from .messages import Message
from .messages.diagnostic_msgs import DiagnosticStatus


@dataclass(frozen=True)
class Frames:
    """Names of the frames that messages are in.

    Attributes:
        odom: the fixed frame, which may drift but never jumps (REP-105).
        base: frame of the robot, on the floor.
        camera: optical frame of the camera; empty for the frame named in the images.
    """

    odom: str = "odom"
    base: str = "base_link"
    camera: str = ""


def outgoing(
    constraints: NavConstraints,
    tracks: Sequence[PersonTrack],
    robot: RobotProfile,
    robot_state: RobotState | None,
    frames: Frames,
    *,
    percentage: bool = False,
    wanted: Callable[[str], bool] = lambda key: True,
    details: Mapping[str, str] | None = None,
    sensors: DiagnosticStatus | None = None,
) -> Iterator[tuple[str, Message]]:
    """Yield topic key (:data:`~nav_adapter.ros2.PUBLISHED`) and message, urgent ones first.

    Without ``robot_state`` there is no grid, since it is centred on the robot. A message is made
    only if ``wanted`` returns True for its key. ``details`` and ``sensors`` are for :func:`alerts`.
    """
    odom, base = frames.odom, frames.base
    if wanted("speed_limit"):
        yield (
            "speed_limit",
            speed_limit(constraints, robot.max_speed_mps, percentage=percentage, state=robot_state),
        )
    if wanted("collision_polygons"):
        for polygon in collision_polygons(
            constraints, robot, robot_state, odom_frame=odom, base_frame=base
        ):
            yield "collision_polygons", polygon
    if wanted("alerts"):
        yield "alerts", alerts(constraints, details=details, sensors=sensors)
    if wanted("stop_zone"):
        _, _, _, forward, left, turn = Motion.of(robot_state) if robot_state else Motion(0.0, 0.0)
        zone = stop_zone(
            robot,
            forward,
            constraints.stamp_s,
            lateral_mps=left,
            yaw_rate_radps=turn,
            base_frame=base,
        )
        yield "stop_zone", zone
    if robot_state is not None and wanted("grid"):
        center = robot_state.position_odom_m
        yield "grid", occupancy_grid(constraints, center, frame_id=odom)
    if wanted("circles"):
        for circle in circle_objects(constraints, frame_id=odom):
            yield "circles", circle
    if wanted("obstacles"):
        yield "obstacles", teb_obstacles(constraints, frame_id=odom)
    if wanted("people"):
        yield "people", people(constraints, tracks, frame_id=odom)
    if wanted("detections"):
        yield "detections", detections(constraints, frame_id=odom)
    if wanted("markers"):
        yield "markers", markers(constraints, robot_state, frame_id=odom)
