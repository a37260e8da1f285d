"""Conversions: between values and messages, and between these messages and those of rclpy."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from importlib import import_module
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray, finite_number

from .._errors import NavError
from .._robot import RobotState
from ._message import FieldType, Message, field_types, ros_type
from .messages.builtin_interfaces import Time
from .messages.geometry_msgs import (
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from .messages.nav_msgs import MapMetaData, OccupancyGrid, Odometry
from .messages.std_msgs import Header

# builtin_interfaces/Time counts whole seconds in 32 bits.
_LATEST_S = 2**31 - 1
# No robot drives this far from the origin of its odom frame.
_FARTHEST_M = 1e6

_AnyMessage = TypeVar("_AnyMessage", bound=Message)


def to_time(stamp_s: float) -> Time:
    """Return a stamp as a message, to the nanosecond.

    Raises:
        NavError: for a stamp that is not finite or outside 0 to 2³¹ − 1 s.
    """
    stamp = finite_number("stamp_s", stamp_s, NavError, minimum=0.0, maximum=_LATEST_S - 1.0)
    # Split first, since a float holds today's seconds only to a quarter of a microsecond.
    sec = math.floor(stamp)
    more, nanosec = divmod(round((stamp - sec) * 1e9), 1_000_000_000)
    return Time(sec + more, nanosec)


def to_seconds(time: Time) -> float:
    """Return the stamp of a message in seconds."""
    return time.sec + 1e-9 * time.nanosec


def header(stamp_s: float, frame_id: str) -> Header:
    """Return a header with time and frame."""
    return Header(to_time(stamp_s), frame_id)


def grid_of(
    stamp_s: float, frame_id: str, origin_m: FloatArray, side_m: float, cells: NDArray[np.int8]
) -> OccupancyGrid:
    """Return cells (rows, columns) as a grid with its lower left corner at ``origin_m`` (2,)."""
    (rows, columns), (x, y) = cells.shape, origin_m.tolist()
    info = MapMetaData(to_time(stamp_s), side_m, columns, rows, Pose(Point(x, y, 0.0)))
    return OccupancyGrid(header(stamp_s, frame_id), info, cells.tobytes())


def yaw_quaternion(yaw_rad: float) -> Quaternion:
    """Return the quaternion of a rotation about z."""
    return Quaternion(z=math.sin(0.5 * yaw_rad), w=math.cos(0.5 * yaw_rad))


def odometry_of(
    state: RobotState, *, frame_id: str = "odom", child_frame_id: str = "base_link"
) -> Odometry:
    """Return a robot's pose in odom and its velocity in the base frame as a message."""
    x_m, y_m = state.position_odom_m.tolist()
    linear = Vector3(state.speed_mps, state.lateral_mps, 0.0)
    return Odometry(
        header(state.stamp_s, frame_id),
        child_frame_id,
        PoseWithCovariance(Pose(Point(x_m, y_m, 0.0), yaw_quaternion(state.heading_odom_rad))),
        TwistWithCovariance(Twist(linear, Vector3(z=state.yaw_rate_radps))),
    )


def pose_matrix(place_m: Point | Vector3, turn: Quaternion) -> FloatArray:
    """Return the pose (4, 4) of a position and a quaternion, which is normalised.

    Raises:
        NavError: for a number that is not finite, a position beyond 10⁶ m, or a quaternion whose
            length is not near 1.
    """
    position_m = place_m.x, place_m.y, place_m.z
    numbers = np.array([turn.x, turn.y, turn.z, turn.w])
    length = math.hypot(*numbers)  # overflows to infinity without a warning
    # Written so that NaN is refused.
    if not (np.abs(position_m).max() <= _FARTHEST_M and 0.5 < length < 2.0):
        raise NavError(
            f"a pose must have a finite position within {_FARTHEST_M:g} m and a quaternion of "
            f"length 1, got {position_m} m and {numbers.tolist()}"
        )
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(numbers / length).as_matrix()
    pose[:3, 3] = position_m
    return pose


def ros_class(kind: type[Message]) -> Any:
    """Return rclpy's class of a message type.

    Raises:
        ImportError: if the ROS package is not installed, or has another version.
    """
    package, _, name = ros_type(kind).split("/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except AttributeError as cause:
        raise ImportError(
            f"{package}.msg has no {name}: the package has another version"
        ) from cause


def to_ros(message: Message, find: Callable[[type[Message]], Any] = ros_class) -> Any:
    """Return a message of rclpy, for ``Publisher.publish``.

    Args:
        message: of this package.
        find: returns rclpy's class of a message type.
    """
    ros_message = find(type(message))()
    for name, kind in field_types(type(message)).items():
        setattr(ros_message, name, _to_ros(getattr(message, name), kind, find))
    return ros_message


def from_ros(kind: type[_AnyMessage], message: Any) -> _AnyMessage:
    """Return a message of this package from one of rclpy."""
    fields = field_types(kind)
    return kind(**{name: _from_ros(getattr(message, name), fields[name]) for name in fields})


def _to_ros(value: Any, kind: FieldType, find: Callable[[type[Message]], Any]) -> Any:
    """Return the value of a field as rclpy takes it."""
    if kind.message is not None:
        return to_ros(value, find) if kind.count is None else [to_ros(each, find) for each in value]
    if kind.name == "byte":
        return bytes([value])
    if kind.count is None:
        return value
    if kind.name in ("int8", "uint8"):
        # rosidl wants an array for a sequence, and any sequence of the right length for an array.
        return array("b" if kind.name == "int8" else "B", value) if kind.count == 0 else list(value)
    return list(value)


def _from_ros(value: Any, kind: FieldType) -> Any:
    """Return the value of a field as the messages of this package hold it."""
    if kind.message is not None:
        if kind.count is None:
            return from_ros(kind.message, value)
        return tuple(from_ros(kind.message, each) for each in value)
    if kind.name == "byte":
        return value[0] if isinstance(value, bytes) else value
    if kind.count is None:
        return value
    if kind.name in ("int8", "uint8"):
        return bytes(memoryview(value).cast("B")) if not isinstance(value, list) else bytes(value)
    return tuple(value.tolist()) if hasattr(value, "tolist") else tuple(value)
