"""ROS package diagnostic_msgs."""

from __future__ import annotations

from typing import ClassVar

from .._message import Byte, Message, String
from .std_msgs import Header


class KeyValue(Message):
    """A name and its value."""

    key: String = ""
    value: String = ""


class DiagnosticStatus(Message):
    """The status of one part of the robot."""

    OK: ClassVar[int] = 0
    WARN: ClassVar[int] = 1
    ERROR: ClassVar[int] = 2
    STALE: ClassVar[int] = 3

    level: Byte = 0
    name: String = ""
    message: String = ""
    hardware_id: String = ""
    values: tuple[KeyValue, ...] = ()


class DiagnosticArray(Message):
    """The status of several parts at one time."""

    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()
