"""ROS package nav_msgs."""

from __future__ import annotations

from .._message import Float32, Int8s, Message, String, UInt32
from .builtin_interfaces import Time
from .geometry_msgs import Pose, PoseWithCovariance, TwistWithCovariance
from .std_msgs import Header


class MapMetaData(Message):
    """Size, resolution (m), and the pose of the lower left corner of cell (0, 0)."""

    map_load_time: Time = Time()
    resolution: Float32 = 0.0
    width: UInt32 = 0
    height: UInt32 = 0
    origin: Pose = Pose()


class OccupancyGrid(Message):
    """A grid, row by row from the lower left: 0 free to 100 occupied, −1 unknown."""

    header: Header = Header()
    info: MapMetaData = MapMetaData()
    data: Int8s = b""


class Odometry(Message):
    """Pose in the header's frame, velocity in the child's."""

    header: Header = Header()
    child_frame_id: String = ""
    pose: PoseWithCovariance = PoseWithCovariance()
    twist: TwistWithCovariance = TwistWithCovariance()
