"""Messages of ROS 2 that the robot of a crossing publishes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from shapely.geometry import Point as Point2d

from nav_adapter import PersonObstacle, RobotState
from nav_adapter.ros2.conversions import header, to_seconds, to_time, yaw_quaternion
from nav_adapter.ros2.messages.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import MapMetaData, OccupancyGrid
from nav_adapter.ros2.messages.people_msgs import People
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image, LaserScan
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import Camera, laser
from perception.anthropometry import MEAN_STATURE_M
from perception.arrays import FloatArray, ImageRgb
from tracking import PersonTrack

#: Frames by their usual names (REP-105).
MAP: Final = "map"
ODOM: Final = "odom"
BASE: Final = "base_link"
CAMERA: Final = "camera_optical_frame"


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


def people_of(message: People) -> tuple[tuple[PersonObstacle, ...], tuple[PersonTrack, ...]]:
    """Return the people of an adapter outside as its obstacles, and as tracks where it has one.

    Their covariances are not in the message, and 0 in the tracks.
    """
    obstacles, tracks = [], []
    for person in message.people:
        tags: dict[str, str] = dict(zip(person.tagnames, person.tags, strict=True))
        who, lower = int(person.name), float(tags["awareness_lower"])
        place, velocity = (
            np.array([each.x, each.y]) for each in (person.position, person.velocity)
        )
        radius_m = float(tags["radius_m"])
        circle = Point2d(place).buffer(radius_m)
        obstacles.append(
            PersonObstacle(who, place, velocity, radius_m, MEAN_STATURE_M, lower, circle)
        )
        if "awareness" in tags:
            tracks.append(
                PersonTrack(
                    who,
                    to_seconds(message.header.stamp),
                    tags["status"],  # type: ignore[arg-type]
                    place,
                    velocity,
                    np.zeros((4, 4)),
                    float(tags["awareness"]),
                    float(tags["awareness_std"]),
                    lower,
                    MEAN_STATURE_M,
                    float(tags["time_since_seen_s"]),
                )
            )
    return tuple(obstacles), tuple(tracks)
