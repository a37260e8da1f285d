"""The command ``awarenav bridge``."""

from __future__ import annotations

import argparse
import os
from pathlib import Path


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``bridge`` to the commands."""
    bridge = commands.add_parser(
        "bridge",
        help="read a camera over ROS 2, publish obstacles and a speed limit for Nav2",
        description="Read a camera, its calibration and the robot's odometry from ROS 2 topics, "
        "find and track people, and publish what Nav2, its collision monitor, TEB and RViz read: "
        "speed limit, polygons, grid, circles, obstacles, people, boxes, markers, alerts. No "
        "ROS is needed. Whatever is missing or late makes it publish a stop and say why. See "
        "docs/nav2.md for the parameters to set in Nav2.",
        epilog="Exit status: 0 ended by Ctrl-C or --seconds, 2 bad input. The network interface is "
        "chosen by CYCLONEDDS_URI, as with rmw_cyclonedds_cpp. Needs the extra 'ros2': "
        "pip install 'awarenav[ros2]'.",
    )
    bridge.add_argument(
        "--robot",
        type=Path,
        required=True,
        metavar="FILE",
        help="footprint, speeds, braking and camera mount (YAML; docs/nav2/robot.yaml is one)",
    )
    bridge.add_argument(
        "--policy",
        default="balanced",
        metavar="NAME|FILE",
        help="preset or policy YAML file (default: balanced)",
    )
    bridge.add_argument(
        "--domain",
        type=int,
        default=None,
        metavar="N",
        help="DDS domain (default: ROS_DOMAIN_ID, else 0)",
    )
    bridge.add_argument(
        "--rate",
        type=float,
        default=20.0,
        metavar="HZ",
        help="how often everything is published, images or none (default: 20)",
    )
    bridge.add_argument(
        "--seconds", type=float, default=None, metavar="S", help="end by itself after so long"
    )
    networks = bridge.add_argument_group(
        "networks",
        "those in the box are made for the simulator: on a robot, give some that were trained on "
        "photographs (`awarenav models`)",
    )
    networks.add_argument(
        "--detector",
        default="shipped",
        metavar="NAME|FILE",
        help="as for `awarenav estimate` (default: shipped)",
    )
    networks.add_argument(
        "--pose", default="shipped", metavar="NAME|FILE|mediapipe", help="likewise"
    )
    networks.add_argument(
        "--head", default="auto", metavar="auto|network|pnp|fused|FILE", help="likewise"
    )
    read = bridge.add_argument_group("topics to read")
    read.add_argument("--image", default="camera/image_raw", metavar="TOPIC")
    read.add_argument(
        "--compressed",
        action="store_true",
        help="the image topic is a sensor_msgs/CompressedImage",
    )
    read.add_argument("--camera-info", default="camera/camera_info", metavar="TOPIC")
    read.add_argument(
        "--camera",
        type=Path,
        metavar="FILE",
        help="calibration from a ROS camera_info YAML instead of the topic",
    )
    read.add_argument("--odom", default="odom", metavar="TOPIC", help="nav_msgs/Odometry")
    read.add_argument("--odom-frame", default="odom", metavar="FRAME")
    read.add_argument("--base-frame", default="base_link", metavar="FRAME")
    read.add_argument(
        "--camera-frame",
        default="",
        metavar="FRAME",
        help="optical frame in tf (default: the images' own); not used if the robot file has a "
        "camera mount",
    )
    write = bridge.add_argument_group("topics to publish")
    write.add_argument(
        "--topic",
        action="append",
        default=[],
        metavar="KEY=TOPIC",
        help="publish under another name, e.g. speed_limit=robot1/speed_limit",
    )
    write.add_argument(
        "--only",
        nargs="+",
        default=None,
        metavar="KEY",
        help="publish these only: speed_limit collision_polygons stop_zone grid circles obstacles "
        "people detections markers alerts (default: all)",
    )
    write.add_argument(
        "--percentage",
        action="store_true",
        help="send the speed limit in per cent of the robot's maximum instead of m/s",
    )
    log = bridge.add_argument_group("recordings")
    log.add_argument(
        "--record",
        type=Path,
        metavar="FILE.mcap",
        help="write what is published, and odometry and tf as read, for Foxglove",
    )
    log.add_argument(
        "--rerun",
        type=Path,
        metavar="FILE.rrd",
        help="write image, keypoints, cones, tracks, radii and speed for Rerun (extra 'viz')",
    )
    bridge.set_defaults(run=_bridge)


def domain_of(option: int | None) -> int | str:
    """The domain asked for; a text that is no number is returned for the refusal."""
    if option is not None:
        return option
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    return int(text) if text.isdigit() else text


def _bridge(options: argparse.Namespace) -> int:
    from ._bridge_command import bridge_command  # noqa: PLC0415 - help needs no perception

    return bridge_command(options)
