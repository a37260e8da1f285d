"""ROS package nav2_msgs."""

from __future__ import annotations

from .._message import Bool, Float32, Float64, Int8, Message, String, UInt8
from .geometry_msgs import Point32
from .std_msgs import Header
from .unique_identifier_msgs import UUID


class SpeedLimit(Message):
    """A limit in m/s or in per cent of the controller's maximum; 0.0 means no limit."""

    header: Header = Header()
    percentage: Bool = False
    speed_limit: Float64 = 0.0


class CircleObject(Message):
    """A circle of the vector-object server (Nav2 Kilted and later)."""

    header: Header = Header()
    uuid: UUID = UUID()
    center: Point32 = Point32()
    radius: Float32 = 0.0
    fill: Bool = False
    value: Int8 = 0


class CostmapFilterInfo(Message):
    """The meaning of a filter mask: base + multiplier × value; type 1 is a speed in per cent."""

    header: Header = Header()
    type: UInt8 = 0
    filter_mask_topic: String = ""
    base: Float32 = 0.0
    multiplier: Float32 = 0.0
