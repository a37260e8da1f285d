"""Messages of ROS 2 that the robot of a crossing publishes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from nav_adapter import RobotState
from nav_adapter.ros2.conversions import header, to_time, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import MapMetaData, OccupancyGrid, Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image, LaserScan
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import Camera, laser
from perception.arrays import FloatArray, ImageRgb

#: Frames by their usual names (REP-105).
MAP: Final = "map"
ODOM: Final = "odom"
BASE: Final = "base_link"
CAMERA: Final = "camera_optical_frame"


def odometry(state: RobotState) -> Odometry:
    """Return the pose in odom and the velocity in the base frame."""
    top = header(state.stamp_s, ODOM)
    x, y = state.position_odom_m.tolist()
    pose = Pose(Point(x, y, 0.0), yaw_quaternion(state.heading_odom_rad))
    linear = Vector3(state.speed_mps, state.lateral_mps, 0.0)
    twist = Twist(linear, Vector3(0.0, 0.0, state.yaw_rate_radps))
    return Odometry(top, BASE, PoseWithCovariance(pose), TwistWithCovariance(twist))


def base_transform(state: RobotState) -> TFMessage:
    """Return where the base frame is in odom."""
    x, y = state.position_odom_m.tolist()
    turn = yaw_quaternion(state.heading_odom_rad)
    top = header(state.stamp_s, ODOM)
    return TFMessage((TransformStamped(top, BASE, Transform(Vector3(x, y, 0.0), turn)),))


def static_transforms(stamp_s: float, mounts: dict[str, FloatArray]) -> TFMessage:
    """Return odom in the map, where they are the same, and the sensors on the base.

    Args:
        stamp_s: of all.
        mounts: pose (4, 4) in the base frame, by the name of the sensor's frame.
    """
    poses = [(MAP, ODOM, np.eye(4)), *((BASE, name, pose) for name, pose in mounts.items())]
    return TFMessage(
        tuple(
            TransformStamped(header(stamp_s, parent), child, _transform(pose))
            for parent, child, pose in poses
        )
    )


def _transform(pose: FloatArray) -> Transform:
    x, y, z = pose[:3, 3].tolist()
    turn = Quaternion(*Rotation.from_matrix(pose[:3, :3]).as_quat().tolist())
    return Transform(Vector3(x, y, z), turn)


def scan_message(
    scan: laser.LaserScan, start_s: float, frame_id: str, period_s: float
) -> LaserScan:
    """Return a sweep.

    Args:
        scan: its stamp is that of the first ray.
        start_s: time of the clock at which the scan's own time began.
        frame_id: of the scanner.
        period_s: time from sweep to sweep.
    """
    last = (len(scan.ranges_m) - 1) * scan.angle_increment_rad
    return LaserScan(
        header(max(start_s + scan.stamp_s, 0.0), frame_id),
        scan.angle_min_rad,
        scan.angle_min_rad + last,
        scan.angle_increment_rad,
        scan.time_increment_s,
        period_s,
        scan.range_min_m,
        scan.range_max_m,
        tuple(np.asarray(scan.ranges_m, dtype=np.float32).tolist()),
    )


def map_message(
    stamp_s: float, occupied: NDArray[np.bool_], origin_m: FloatArray, resolution_m: float
) -> OccupancyGrid:
    """Return the map of a hall: 100 in occupied cells (H, W), 0 elsewhere."""
    rows, columns = occupied.shape
    x, y = origin_m.tolist()
    about = MapMetaData(to_time(stamp_s), resolution_m, columns, rows, Pose(Point(x, y, 0.0)))
    cells = np.where(occupied, np.int8(100), np.int8(0)).tobytes()
    return OccupancyGrid(header(stamp_s, MAP), about, cells)


def picture_messages(
    stamp_s: float, frame_id: str, camera: Camera, rgb: ImageRgb
) -> tuple[Image, CameraInfo]:
    """Return an image (H, W, 3) and the calibration of its camera, which has no distortion."""
    top = header(stamp_s, frame_id)
    height, width = camera.height_px, camera.width_px
    image = Image(top, height, width, "rgb8", 0, 3 * width, np.ascontiguousarray(rgb).tobytes())
    k = camera.matrix
    eye = tuple(np.eye(3).ravel().tolist())
    p = tuple(np.column_stack([k, np.zeros(3)]).ravel().tolist())
    about = CameraInfo(
        *(top, height, width, "plumb_bob", (0.0,) * 5, tuple(k.ravel().tolist()), eye, p)
    )
    return image, about


def goal_pose(stamp_s: float, goal_m: Sequence[float], yaw_rad: float) -> PoseStamped:
    """Return a goal in the map."""
    x, y = goal_m
    return PoseStamped(header(stamp_s, MAP), Pose(Point(x, y, 0.0), yaw_quaternion(yaw_rad)))
