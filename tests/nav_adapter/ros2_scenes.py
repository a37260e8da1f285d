"""Messages, people and independent definitions for the tests of nav_adapter.ros2."""

from __future__ import annotations

import dataclasses
from typing import Any

from nav_scenes import ROBOT, person, robot_at
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints
from nav_adapter.ros2 import Frames, outgoing
from nav_adapter.ros2.messages import Message
from tracking import PersonTrack

STAMP_S = 1_700_000_000.25

# Messages that rosbags does not ship, from their .msg files.
DEFINITIONS = {
    "nav2_msgs/msg/SpeedLimit": "std_msgs/Header header\nbool percentage\nfloat64 speed_limit\n",
    "nav2_msgs/msg/CostmapFilterInfo": "std_msgs/Header header\nuint8 type\n"
    "string filter_mask_topic\nfloat32 base\nfloat32 multiplier\n",
    "nav2_msgs/msg/CircleObject": "std_msgs/Header header\nunique_identifier_msgs/UUID uuid\n"
    "geometry_msgs/Point32 center\nfloat32 radius\nbool fill\nint8 value\n",
    "costmap_converter_msgs/msg/ObstacleMsg": "std_msgs/Header header\n"
    "geometry_msgs/Polygon polygon\nfloat64 radius\nint64 id\n"
    "geometry_msgs/Quaternion orientation\ngeometry_msgs/TwistWithCovariance velocities\n",
    "costmap_converter_msgs/msg/ObstacleArrayMsg": "std_msgs/Header header\n"
    "costmap_converter_msgs/ObstacleMsg[] obstacles\n",
    "people_msgs/msg/Person": "string name\ngeometry_msgs/Point position\n"
    "geometry_msgs/Point velocity\nfloat64 reliability\nstring[] tagnames\nstring[] tags\n",
    "people_msgs/msg/People": "std_msgs/Header header\npeople_msgs/Person[] people\n",
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\n"
    "geometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
    "vision_msgs/msg/Detection3D": "std_msgs/Header header\n"
    "vision_msgs/ObjectHypothesisWithPose[] results\nvision_msgs/BoundingBox3D bbox\nstring id\n",
    "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\n"
    "vision_msgs/Detection3D[] detections\n",
}


def typestore() -> Any:
    """Return rosbags' types of ROS 2 Jazzy and those above, independent of this library."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def crowd(stamp_s: float = STAMP_S) -> tuple[PersonTrack, ...]:
    return (
        person(stamp_s, track_id=3, position=(2.5, 0.4), velocity=(-0.6, 0.2)),
        person(stamp_s, track_id=0, position=(6.0, -1.0), awareness_lower=0.7, sigma_m=0.05),
        person(stamp_s, track_id=11, position=(4.0, 3.0), status="coasting", unseen_s=0.1),
    )


def constraints(stamp_s: float = STAMP_S) -> NavConstraints:
    """Return the adapter's constraints for that crowd."""
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT)
    return adapter.update(crowd(stamp_s), robot_at(stamp_s, speed_mps=0.5), stamp_s)


def everything(stamp_s: float = STAMP_S) -> list[tuple[str, Message]]:
    """Return the messages of one update on every topic."""
    state = robot_at(stamp_s, position=(0.3, -0.2), speed_mps=0.5)
    return list(outgoing(constraints(stamp_s), crowd(stamp_s), ROBOT, state, Frames()))


def plain(value: Any) -> Any:
    """Return a message of any library as nested dicts and lists of Python's own types."""
    if dataclasses.is_dataclass(value):
        # In rosbags a type's constants and its name are fields too.
        names = [field.name for field in dataclasses.fields(value)]
        return {name: plain(getattr(value, name)) for name in names if name[0].islower()}
    if isinstance(value, bytes):
        return list(value)
    if hasattr(value, "tolist"):
        # int8 and uint8 arrays are bytes here.
        return [each % 256 for each in value.tolist()] if value.itemsize == 1 else value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value
