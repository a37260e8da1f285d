"""ROS package unique_identifier_msgs."""

from __future__ import annotations

from dataclasses import dataclass

from .._message import Message, UInt8x16


@dataclass(frozen=True)
class UUID(Message):
    """A UUID of 16 bytes, after RFC 9562."""

    uuid: UInt8x16 = bytes(16)
