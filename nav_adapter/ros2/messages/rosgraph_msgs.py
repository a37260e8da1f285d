"""ROS package rosgraph_msgs."""

from __future__ import annotations

from dataclasses import dataclass

from .._message import Message
from .builtin_interfaces import Time


@dataclass(frozen=True)
class Clock(Message):
    """The present time of a simulator, for nodes with ``use_sim_time``."""

    clock: Time = Time()
