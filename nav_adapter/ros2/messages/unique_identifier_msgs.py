"""ROS package unique_identifier_msgs."""

from __future__ import annotations

from .._message import Message, UInt8x16


class UUID(Message):
    """A UUID of 16 bytes, after RFC 9562."""

    uuid: UInt8x16 = bytes(16)
