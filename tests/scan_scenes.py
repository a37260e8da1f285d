"""Exact scans of people on two legs in a rectangular room, as ROS messages."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.sensor_msgs import LaserScan
from nav_adapter.ros2.messages.std_msgs import Header

RAYS, STEP_RAD = 541, math.radians(0.5)
ROOM_M = (-6.0, -5.0, 8.0, 5.0)
LEG_M, APART_M = 0.06, 0.22


def planar(x_m: float, y_m: float = 0.0, yaw_rad: float = 0.0, z_m: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
    T[:2, :2] = [[cos, -sin], [sin, cos]]
    T[:3, 3] = x_m, y_m, z_m
    return T


def ranges_of(people: Sequence[tuple[float, float]], origins, rays) -> np.ndarray:
    """Return the range of each ray (N, 2) from its origin (N, 2); legs stand across the first."""
    rays = np.where(rays == 0.0, 1e-12, rays)
    walls = (np.where(rays > 0.0, ROOM_M[2:], ROOM_M[:2]) - origins) / rays
    ranges = walls.min(axis=1)
    for x, y in people:
        away = np.array([x, y]) - origins[0]
        across = np.array([-away[1], away[0]]) / np.linalg.norm(away)
        for side in (-0.5, 0.5):
            to = np.array([x, y]) + side * APART_M * across - origins
            along = (to * rays).sum(axis=1)
            inside = along**2 - (to * to).sum(axis=1) + LEG_M**2
            near = along - np.sqrt(np.maximum(inside, 0.0))
            ranges = np.where((inside >= 0.0) & (along > 0.0), np.minimum(ranges, near), ranges)
    return ranges


def scan_message(
    stamp_s: float,
    people: Sequence[tuple[float, float]] = (),
    T_odom_scanner: np.ndarray | None = None,
    *,
    poses: Sequence[np.ndarray] | None = None,
    frame_id: str = "scanner",
    time_increment_s: float = 0.0,
    low_rad: float = math.radians(-135.0),
    rays: int = RAYS,
) -> LaserScan:
    """Return a sweep from one pose, or with a pose of the scanner for every ray."""
    if poses is None:
        poses = [planar(0.3, 0.0, 0.0) if T_odom_scanner is None else T_odom_scanner] * rays
    angles = low_rad + STEP_RAD * np.arange(rays)
    own = np.column_stack((np.cos(angles), np.sin(angles)))
    directions = np.array([T[:2, :2] @ ray for T, ray in zip(poses, own, strict=True)])
    ranges = ranges_of(people, np.array([T[:2, 3] for T in poses]), directions)
    noise = 0.01 * np.random.default_rng(round(1e3 * stamp_s)).normal(size=rays)
    return LaserScan(
        Header(to_time(stamp_s), frame_id),
        angle_min=low_rad,
        angle_max=float(angles[-1]),
        angle_increment=STEP_RAD,
        time_increment=time_increment_s,
        scan_time=0.04,
        range_min=0.05,
        range_max=20.0,
        ranges=tuple((ranges + noise).tolist()),
    )
