"""People, speed limit and stop as messages that ROS 2, Nav2 and its neighbours read.

No ROS is needed. The conversions are pure functions of :class:`~nav_adapter.NavConstraints`, the
messages plain dataclasses (:mod:`nav_adapter.ros2.messages`). Publishing and recording need the
extra ``ros2``: :func:`encode`, :class:`DdsNode` and :class:`McapRecorder` load it when they are
asked for. Under ROS, :mod:`nav_adapter.ros2.node` is the same bridge as an rclpy node.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._alerts import alerts
from ._bridge import AwarenessBridge
from ._grid import occupancy_grid
from ._markers import markers
from ._outgoing import Frames, outgoing
from ._people import circle_objects, detections, people, teb_obstacles
from ._pictures import camera_of, picture_of
from ._polygons import STOP_POLYGON_ID, collision_polygons, stop_zone
from ._robot_file import CameraMount, RobotFile
from ._speed_limit import SLOWEST_MPS, speed_limit
from ._topics import PUBLISHED, READ, Topic, renamed
from ._transforms import TransformBuffer

if TYPE_CHECKING:
    from ._cdr import decode, encode
    from ._dds import DdsNode
    from ._mcap import McapRecorder

__all__ = [
    "PUBLISHED",
    "READ",
    "SLOWEST_MPS",
    "STOP_POLYGON_ID",
    "AwarenessBridge",
    "CameraMount",
    "DdsNode",
    "Frames",
    "McapRecorder",
    "RobotFile",
    "Topic",
    "TransformBuffer",
    "alerts",
    "camera_of",
    "circle_objects",
    "collision_polygons",
    "decode",
    "detections",
    "encode",
    "markers",
    "occupancy_grid",
    "outgoing",
    "people",
    "picture_of",
    "renamed",
    "speed_limit",
    "stop_zone",
    "teb_obstacles",
]


def __getattr__(name: str) -> Any:
    """Load what needs the extra ``ros2`` when it is asked for."""
    if name in ("decode", "encode"):
        from . import _cdr  # noqa: PLC0415

        return getattr(_cdr, name)
    if name == "DdsNode":
        from ._dds import DdsNode  # noqa: PLC0415

        return DdsNode
    if name == "McapRecorder":
        from ._mcap import McapRecorder  # noqa: PLC0415

        return McapRecorder
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
