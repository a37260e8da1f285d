"""People as obstacles, people and boxes of other ROS packages."""

from __future__ import annotations

import uuid
from collections.abc import Iterable
from typing import Final

from tracking import PersonTrack

from .._constraints import NavConstraints
from ..exporters import boxes
from .conversions import header, yaw_quaternion
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
from .messages.people_msgs import People, Person
from .messages.unique_identifier_msgs import UUID
from .messages.vision_msgs import (
    BoundingBox3D,
    Detection3D,
    Detection3DArray,
    ObjectHypothesis,
    ObjectHypothesisWithPose,
)

_OCCUPIED: Final = 100
# Any fixed namespace, so that a track has the same UUID in every process.
_NAMESPACE: Final = uuid.UUID("6f1b3f0a-6f53-4d5e-9c0e-5b2f3f8a7c11")
_RELIABILITY: Final = {"confirmed": 1.0, "coasting": 0.5, "tentative": 0.25}


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
