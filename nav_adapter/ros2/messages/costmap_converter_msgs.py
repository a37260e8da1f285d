"""ROS package costmap_converter_msgs, which the TEB planner reads."""

from __future__ import annotations

from .._message import Float64, Int64, Message
from .geometry_msgs import Polygon, Quaternion, TwistWithCovariance
from .std_msgs import Header


class ObstacleMsg(Message):
    """An obstacle: a polygon, or a circle if it has one point and a radius."""

    header: Header = Header()
    polygon: Polygon = Polygon()
    radius: Float64 = 0.0
    id: Int64 = 0
    orientation: Quaternion = Quaternion()
    velocities: TwistWithCovariance = TwistWithCovariance()


class ObstacleArrayMsg(Message):
    """All obstacles at one time."""

    header: Header = Header()
    obstacles: tuple[ObstacleMsg, ...] = ()
