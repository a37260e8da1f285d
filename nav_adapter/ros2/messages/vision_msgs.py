"""ROS package vision_msgs, version 4 (ROS 2 Humble and later)."""

from __future__ import annotations

from .._message import Float64, Message, String
from .geometry_msgs import Pose, PoseWithCovariance, Vector3
from .std_msgs import Header


class BoundingBox3D(Message):
    """A box: pose of the centre and lengths of the sides."""

    center: Pose = Pose()
    size: Vector3 = Vector3()


class ObjectHypothesis(Message):
    """A class and its score."""

    class_id: String = ""
    score: Float64 = 0.0


class ObjectHypothesisWithPose(Message):
    """A class, its score and the pose of the object."""

    hypothesis: ObjectHypothesis = ObjectHypothesis()
    pose: PoseWithCovariance = PoseWithCovariance()


class Detection3D(Message):
    """One object; its id stays the same over time."""

    header: Header = Header()
    results: tuple[ObjectHypothesisWithPose, ...] = ()
    bbox: BoundingBox3D = BoundingBox3D()
    id: String = ""


class Detection3DArray(Message):
    """All objects at one time."""

    header: Header = Header()
    detections: tuple[Detection3D, ...] = ()
