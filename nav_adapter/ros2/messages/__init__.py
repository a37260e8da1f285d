"""ROS 2 messages as frozen dataclasses, one module a ROS package; no ROS needed.

Field names, order and types are those of the ``.msg`` files of ROS 2 Humble to Kilted, so the class
alone decides the wire format, the schema of a recording and the name of the type.
"""

from __future__ import annotations

from .._message import Message, definition, ros_type

__all__ = ["Message", "definition", "ros_type"]
