"""ROS 2 messages as frozen dataclasses, with one module per ROS package; no ROS is needed.

Names, order and types of the fields are those of the ``.msg`` files of ROS 2 Humble to Kilted. Wire
format, schema of a recording and name of the type follow from the class alone.
"""

from __future__ import annotations

from .._message import Message, definition, ros_type

__all__ = ["Message", "definition", "ros_type"]
