"""ROS 2: people, speed limit and stop as messages for Nav2 and related packages, without ROS.

The messages are plain dataclasses (:mod:`nav_adapter.ros2.messages`), made by pure functions of
:class:`~nav_adapter.NavConstraints`. Publishing and recording need the extra ``ros2``, which
:func:`encode`, :func:`decode`, :class:`DdsNode` and :class:`McapRecorder` load at first use. With
ROS installed, :mod:`nav_adapter.ros2.node` runs the same bridge as an rclpy node. Times, poses and
rclpy's messages are converted in :mod:`nav_adapter.ros2.conversions`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

from ._alerts import alerts
from ._bridge import AwarenessBridge
from ._image_input import PerceivedFrame
from ._images import camera_of, depth_of, picture_of
from ._navigator import Navigator
from ._outgoing import Frames, outgoing
from ._people import circle_objects, detections, markers, occupancy_grid, people, teb_obstacles
from ._polygons import STOP_POLYGON_ID, collision_polygons, stop_zone
from ._poses import odometry_problems, optical_problem
from ._robot_file import CameraMount, RobotFile, ScannerMount
from ._scan_input import ScannerInput, scanner_inputs
from ._scans import ScanMessages, laser_scan_of, map_cells_of
from ._speed_limit import SLOWEST_MPS, speed_limit
from ._speed_mask import SpeedMaskSettings, SpeedMaskStream, speed_mask
from ._threads import PerceptionThread, ScanThread
from ._topics import MASK_TOPICS, PUBLISHED, READ, Topic, is_rectified, renamed
from ._transforms import TransformBuffer

if TYPE_CHECKING:
    from ._cdr import decode, encode
    from ._dds import DdsNode
    from ._mcap import McapRecorder

__all__ = [
    "MASK_TOPICS",
    "PUBLISHED",
    "READ",
    "SLOWEST_MPS",
    "STOP_POLYGON_ID",
    "AwarenessBridge",
    "CameraMount",
    "DdsNode",
    "Frames",
    "McapRecorder",
    "Navigator",
    "PerceivedFrame",
    "PerceptionThread",
    "RobotFile",
    "ScanMessages",
    "ScanThread",
    "ScannerInput",
    "ScannerMount",
    "SpeedMaskSettings",
    "SpeedMaskStream",
    "Topic",
    "TransformBuffer",
    "alerts",
    "camera_of",
    "circle_objects",
    "collision_polygons",
    "decode",
    "depth_of",
    "detections",
    "encode",
    "is_rectified",
    "laser_scan_of",
    "map_cells_of",
    "markers",
    "occupancy_grid",
    "odometry_problems",
    "optical_problem",
    "outgoing",
    "people",
    "picture_of",
    "renamed",
    "scanner_inputs",
    "speed_limit",
    "speed_mask",
    "stop_zone",
    "teb_obstacles",
]

__getattr__ = lazy_page(__name__, __file__)
