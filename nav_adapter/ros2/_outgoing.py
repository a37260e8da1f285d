"""All messages for one update, by topic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from tracking import PersonTrack

from .._constraints import NavConstraints
from .._robot import RobotProfile, RobotState
from ._alerts import alerts
from ._people import circle_objects, detections, markers, occupancy_grid, people, teb_obstacles
from ._polygons import collision_polygons, stop_zone
from ._speed_limit import speed_limit
from ._speed_mask import SpeedMaskSettings, SpeedMaskStream
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
    grid_m: float = 10.0,
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
        yield "speed_limit", speed_limit(constraints, robot.max_speed_mps, percentage=percentage)
    if wanted("collision_polygons"):
        for polygon in collision_polygons(
            constraints, robot, robot_state, odom_frame=odom, base_frame=base
        ):
            yield "collision_polygons", polygon
    if wanted("alerts"):
        yield "alerts", alerts(constraints, details=details, sensors=sensors)
    if wanted("stop_zone"):
        moving = robot_state
        forward, left = (moving.speed_mps, moving.lateral_mps) if moving else (0.0, 0.0)
        zone = stop_zone(robot, forward, constraints.stamp_s, lateral_mps=left, base_frame=base)
        yield "stop_zone", zone
    if robot_state is not None and wanted("grid"):
        center = robot_state.position_odom_m
        yield "grid", occupancy_grid(constraints, center, size_m=grid_m, frame_id=odom)
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


class Sender:
    """Makes and publishes the messages of one publication after the other.

    Args:
        publish: called with the key of a topic and a message.
        robot: its profile.
        frames: names of the frames.
        percentage: as in :func:`speed_limit`.
        mask: settings of the speed mask; None for no mask.
    """

    def __init__(
        self,
        publish: Callable[[str, Message], None],
        robot: RobotProfile,
        frames: Frames,
        *,
        percentage: bool,
        mask: SpeedMaskSettings | None = None,
    ) -> None:
        self._publish, self._robot = publish, robot
        self._frames, self._percentage = frames, percentage
        self._mask = None if mask is None else SpeedMaskStream(mask, frames.odom)

    def send(
        self,
        constraints: NavConstraints,
        tracks: tuple[PersonTrack, ...],
        state: RobotState | None,
        details: dict[str, str],
        wanted: Callable[[str], bool],
        sensors: DiagnosticStatus | None = None,
    ) -> None:
        """Publish the topics that are ``wanted``; the arguments are those of :func:`outgoing`."""
        for key, message in outgoing(
            constraints,
            tracks,
            self._robot,
            state,
            self._frames,
            percentage=self._percentage,
            wanted=wanted,
            details=details,
            sensors=sensors,
        ):
            self._publish(key, message)
        if self._mask is not None:
            for key, message in self._mask.messages(constraints, state, wanted):
                self._publish(key, message)
