"""All messages of one instant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tracking import PersonTrack

from .._constraints import NavConstraints
from .._robot import RobotProfile, RobotState
from ._alerts import alerts
from ._grid import occupancy_grid
from ._markers import markers
from ._people import circle_objects, detections, people, teb_obstacles
from ._polygons import collision_polygons, stop_zone
from ._speed_limit import speed_limit
from .messages import Message


@dataclass(frozen=True)
class Frames:
    """Names of the frames that messages are in.

    Attributes:
        odom: fixed, drifting, never jumping (REP-105).
        base: of the robot, on the floor.
        camera: optical frame; empty for the one that the images name.
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
    grid_m: float = 10.0,
) -> Iterator[tuple[str, Message]]:
    """Key of the topic (:data:`~nav_adapter.ros2.PUBLISHED`) and message, the urgent ones first.

    Without ``robot_state`` there is no grid, which is about the robot.
    """
    yield "speed_limit", speed_limit(constraints, robot.max_speed_mps, percentage=percentage)
    for polygon in collision_polygons(
        constraints, robot, robot_state, odom_frame=frames.odom, base_frame=frames.base
    ):
        yield "collision_polygons", polygon
    yield "alerts", alerts(constraints)
    speed_mps = 0.0 if robot_state is None else robot_state.speed_mps
    yield (
        "stop_zone",
        stop_zone(robot, speed_mps, constraints.stamp_s, base_frame=frames.base),
    )
    if robot_state is not None:
        yield (
            "grid",
            occupancy_grid(
                constraints, robot_state.position_odom_m, size_m=grid_m, frame_id=frames.odom
            ),
        )
    for circle in circle_objects(constraints, frame_id=frames.odom):
        yield "circles", circle
    yield "obstacles", teb_obstacles(constraints, frame_id=frames.odom)
    yield "people", people(constraints, tracks, frame_id=frames.odom)
    yield "detections", detections(constraints, frame_id=frames.odom)
    yield "markers", markers(constraints, robot_state, frame_id=frames.odom)
