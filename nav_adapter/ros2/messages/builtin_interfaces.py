"""ROS package builtin_interfaces."""

from __future__ import annotations

from dataclasses import dataclass

from .._message import Int32, Message, UInt32


@dataclass(frozen=True)
class Time(Message):
    """Seconds and nanoseconds since the epoch of the clock."""

    sec: Int32 = 0
    nanosec: UInt32 = 0


@dataclass(frozen=True)
class Duration(Message):
    """A span of time; zero lasts for ever where RViz reads it."""

    sec: Int32 = 0
    nanosec: UInt32 = 0
