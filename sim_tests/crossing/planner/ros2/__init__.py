"""A crossing as a ROS 2 robot: the planner is a stack outside, over DDS."""

from __future__ import annotations

from ._actions import python_with_ros
from ._planner import Ros2Planner
