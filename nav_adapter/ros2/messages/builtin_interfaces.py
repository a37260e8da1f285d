"""ROS package builtin_interfaces."""

from __future__ import annotations

from .._message import Int32, Message, UInt32


class Time(Message):
    """A time: seconds and nanoseconds since the epoch of the clock."""

    sec: Int32 = 0
    nanosec: UInt32 = 0


class Duration(Message):
    """A duration; RViz reads 0 as infinite."""

    sec: Int32 = 0
    nanosec: UInt32 = 0
