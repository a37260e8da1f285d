"""A robot of ROS 2's messages to try ``awarenav bridge`` with, over DDS, without ROS or a robot.

``python examples/ros2_robot.py [SECONDS] [DOMAIN]``: it drives in circles in a hall with two
people, one of whom walks. It publishes odometry and the scans of two scanners, and drives no faster
than the latest limit. Beside it::

    awarenav bridge --robot docs/nav2/robot.yaml --no-camera --scan scan_front --scan scan_rear
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np

from nav_adapter import RobotState
from nav_adapter.ros2 import PUBLISHED, READ, DdsNode, RobotFile, renamed
from nav_adapter.ros2.conversions import header, odometry_of
from nav_adapter.ros2.messages.sensor_msgs import LaserScan

ROBOT = Path(__file__).resolve().parents[1] / "docs" / "nav2" / "robot.yaml"
PERIOD_S, RADIUS_M, ACCELERATION_MPS2 = 0.05, 3.0, 1.0
HALL_M = np.array([[-7.0, -5.0], [7.0, 9.0]])
LEG_M, STRIDE_M = 0.06, 0.2
ANGLES_RAD = np.radians(np.arange(-135.0, 135.5, 0.5))
# Without a limit this old a robot stands.
LATEST_S = 0.5


def people(now_s: float) -> np.ndarray:
    """Return the places of somebody who stands outside the circle, and of one who walks."""
    return np.array([[0.0, 8.0], [5.5, 3.0 + 3.0 * math.sin(0.2 * now_s)]])


def scan(T_odom_scanner: np.ndarray, now_s: float) -> np.ndarray:
    """Return the distances to walls and legs along the rays of a scanner, with noise."""
    rays = np.column_stack((np.cos(ANGLES_RAD), np.sin(ANGLES_RAD))) @ T_odom_scanner[:2, :2].T
    at = T_odom_scanner[:2, 3]
    ranges = (np.where(rays > 0.0, HALL_M[1] - at, HALL_M[0] - at) / rays).min(axis=1)
    for place in people(now_s):
        for side in (-0.5, 0.5):
            to_leg = place - at + np.array([0.0, side * STRIDE_M])
            along = rays @ to_leg
            into_m2 = along**2 - to_leg @ to_leg + LEG_M**2
            hit = (into_m2 > 0.0) & (along > 0.0)
            ranges[hit] = np.minimum(ranges[hit], along[hit] - np.sqrt(into_m2[hit]))
    return ranges + 0.01 * np.random.default_rng().normal(size=len(ranges))


def main(seconds: float = 120.0, domain: int = 0) -> None:
    """Drive, and print place, speed and limit once per second."""
    mounts = RobotFile.from_yaml(ROBOT).scanners or []
    scans = [renamed(READ["scan"], name) for name in ("scan_front", "scan_rear")]
    node = DdsNode(domain)
    for topic in (READ["odom"], *scans):
        node.advertise(topic)
    node.subscribe(PUBLISHED["speed_limit"])
    speed_mps = driven_m = limit_mps = 0.0
    began = heard = time.monotonic()
    for tick in range(round(seconds / PERIOD_S)):
        for message in node.take(PUBLISHED["speed_limit"]):
            limit_mps, heard = message.speed_limit, time.monotonic()
        wanted_mps = limit_mps if time.monotonic() - heard < LATEST_S else 0.0
        change = ACCELERATION_MPS2 * PERIOD_S
        speed_mps += min(max(wanted_mps - speed_mps, -change), change)
        driven_m += speed_mps * PERIOD_S
        yaw_rad = driven_m / RADIUS_M
        x_m, y_m = RADIUS_M * math.sin(yaw_rad), 3.0 - RADIUS_M * math.cos(yaw_rad)

        now_s = time.time()
        state = RobotState(now_s, [x_m, y_m], yaw_rad, speed_mps, speed_mps / RADIUS_M)
        node.publish(READ["odom"], odometry_of(state))
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        T_odom_base = np.array(
            [[cos, -sin, 0, x_m], [sin, cos, 0, y_m], [0, 0, 1, 0], [0, 0, 0, 1]]
        )
        for topic, mount in zip(scans, mounts, strict=True):
            ranges = scan(T_odom_base @ mount.T_base_scanner(), now_s)
            laser = LaserScan(
                header(now_s, topic.name),
                angle_min=float(ANGLES_RAD[0]),
                angle_max=float(ANGLES_RAD[-1]),
                angle_increment=math.radians(0.5),
                range_min=0.05,
                range_max=25.0,
                ranges=tuple(ranges.tolist()),
            )
            node.publish(topic, laser)
        if tick % round(1.0 / PERIOD_S) == 0:
            gap_m = np.linalg.norm(people(now_s) - [x_m, y_m], axis=1).min()
            print(
                f"{tick * PERIOD_S:5.1f} s  at {x_m:5.2f}, {y_m:5.2f} m  {speed_mps:.2f} m/s  "
                f"limit {limit_mps:.2f} m/s  nearest person {gap_m:.1f} m",
                flush=True,
            )
        time.sleep(max(0.0, began + (tick + 1) * PERIOD_S - time.monotonic()))
    node.close()


if __name__ == "__main__":
    main(*(kind(text) for kind, text in zip((float, int), sys.argv[1:], strict=False)))
