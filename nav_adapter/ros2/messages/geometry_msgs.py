"""ROS package geometry_msgs."""

from __future__ import annotations

from .._message import Float32, Float64, Float64x36, Int64, Message, String
from .std_msgs import Header


class Point(Message):
    """A point in metres."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


class Point32(Message):
    """A point in metres, in single precision."""

    x: Float32 = 0.0
    y: Float32 = 0.0
    z: Float32 = 0.0


class Vector3(Message):
    """A direction, a size or a velocity."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


class Quaternion(Message):
    """A rotation; the default is the identity."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0
    w: Float64 = 1.0


class Pose(Message):
    """A position and an orientation."""

    position: Point = Point()
    orientation: Quaternion = Quaternion()


class PoseStamped(Message):
    """A pose with time and frame."""

    header: Header = Header()
    pose: Pose = Pose()


class PoseWithCovariance(Message):
    """A pose with covariance, row by row over x, y, z and rotations about X, Y, Z."""

    pose: Pose = Pose()
    covariance: Float64x36 = (0.0,) * 36


class Twist(Message):
    """A velocity in m/s and rad/s."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()


class TwistStamped(Message):
    """A velocity with time and frame."""

    header: Header = Header()
    twist: Twist = Twist()


class TwistWithCovariance(Message):
    """A velocity with covariance, in the order of a pose."""

    twist: Twist = Twist()
    covariance: Float64x36 = (0.0,) * 36


class Transform(Message):
    """The pose of a child frame in its parent."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


class TransformStamped(Message):
    """A transform whose parent is the frame of the header."""

    header: Header = Header()
    child_frame_id: String = ""
    transform: Transform = Transform()


class Polygon(Message):
    """The corners of a polygon; the last is joined to the first."""

    points: tuple[Point32, ...] = ()


class PolygonStamped(Message):
    """A polygon with time and frame."""

    header: Header = Header()
    polygon: Polygon = Polygon()


class PolygonInstance(Message):
    """A polygon with an id."""

    polygon: Polygon = Polygon()
    id: Int64 = 0


class PolygonInstanceStamped(Message):
    """A polygon with id, time and frame."""

    header: Header = Header()
    polygon: PolygonInstance = PolygonInstance()
