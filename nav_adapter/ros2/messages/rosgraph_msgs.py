"""ROS package rosgraph_msgs."""

from __future__ import annotations

from .._message import Message
from .builtin_interfaces import Time


class Clock(Message):
    """The present time of a simulator, for nodes with ``use_sim_time``."""

    clock: Time = Time()
