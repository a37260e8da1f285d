"""ROS package std_msgs."""

from __future__ import annotations

from .._message import Float32, Message, String
from .builtin_interfaces import Time


class Header(Message):
    """A time and a frame."""

    stamp: Time = Time()
    frame_id: String = ""


class ColorRGBA(Message):
    """Red, green, blue and opacity in [0, 1]."""

    r: Float32 = 0.0
    g: Float32 = 0.0
    b: Float32 = 0.0
    a: Float32 = 0.0
