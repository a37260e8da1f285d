"""The command ``awarenav bridge``."""

from __future__ import annotations

from typing import Any, Final

from ..cli import FilePath, command, option, options

_NETWORKS: Final = "Networks (the shipped ones are made for the simulator; see `awarenav models`)"
_READ: Final = "Topics to read"
_WRITE: Final = "Topics to publish"
_LOG: Final = "Recordings"


@command(
    "bridge",
    epilog="Exit status: 0 ended by Ctrl-C or --seconds; 2 bad input. CYCLONEDDS_URI chooses the "
    "network interface, as with rmw_cyclonedds_cpp. Needs the extra 'ros2': "
    "pip install 'awarenav[ros2]'.",
)
@option(
    "--robot",
    type=FilePath(),
    required=True,
    metavar="FILE",
    help="Footprint, speeds, braking and camera mount (YAML; docs/nav2/robot.yaml is one).",
)
@options.policy()
@option(
    "--domain", type=int, metavar="N", help="DDS domain (default: ROS_DOMAIN_ID, or 0 without it)."
)
@option(
    "--rate",
    type=float,
    default=20.0,
    metavar="HZ",
    help="How often everything is published, with or without new images.",
)
@option("--seconds", type=float, metavar="S", help="End after this time.")
@option(
    "--detector",
    group=_NETWORKS,
    default="shipped",
    metavar="NAME|FILE",
    help="Person detector, as for `awarenav estimate`.",
)
@option(
    "--pose",
    group=_NETWORKS,
    default="shipped",
    metavar="NAME|FILE|mediapipe",
    help="Pose network, as for `awarenav estimate`.",
)
@option(
    "--head",
    group=_NETWORKS,
    default="auto",
    metavar="auto|network|pnp|fused|FILE",
    help="Head pose, as for `awarenav estimate`.",
)
@option(
    "--image", group=_READ, default="camera/image_raw", metavar="TOPIC", help="sensor_msgs/Image."
)
@option(
    "--compressed",
    group=_READ,
    is_flag=True,
    help="The image topic is a sensor_msgs/CompressedImage.",
)
@option(
    "--camera-info",
    group=_READ,
    default="camera/camera_info",
    metavar="TOPIC",
    help="sensor_msgs/CameraInfo.",
)
@option(
    "--camera",
    group=_READ,
    type=FilePath(),
    metavar="FILE",
    help="Calibration from a ROS camera_info YAML instead of the topic.",
)
@option("--odom", group=_READ, default="odom", metavar="TOPIC", help="nav_msgs/Odometry.")
@option("--odom-frame", group=_READ, default="odom", metavar="FRAME", help="Fixed frame in tf.")
@option("--base-frame", group=_READ, default="base_link", metavar="FRAME", help="Robot's frame.")
@option(
    "--camera-frame",
    group=_READ,
    default="",
    metavar="FRAME",
    help="Optical frame in tf (default: the images' own); not used if the robot file has a camera "
    "mount.",
)
@option(
    "--topic",
    group=_WRITE,
    many=True,
    metavar="KEY=TOPIC...",
    help="Publish under another name, e.g. speed_limit=robot1/speed_limit.",
)
@option(
    "--only",
    group=_WRITE,
    many=True,
    metavar="KEY...",
    help="Publish these only: speed_limit collision_polygons stop_zone grid circles obstacles "
    "people detections markers alerts (default: all).",
)
@option(
    "--percentage",
    group=_WRITE,
    is_flag=True,
    help="Send the speed limit in per cent of the robot's maximum instead of m/s.",
)
@option(
    "--record",
    group=_LOG,
    type=FilePath(),
    metavar="FILE.mcap",
    help="Write what is published, and odometry and tf as read, for Foxglove.",
)
@option(
    "--rerun",
    group=_LOG,
    type=FilePath(),
    metavar="FILE.rrd",
    help="Write images, keypoints, cones, tracks, radii and speed for Rerun (extra 'viz').",
)
def bridge(**values: Any) -> int:
    """Find and track people in a ROS 2 camera, and publish obstacles and a speed limit for Nav2.

    Reads images, calibration and odometry; publishes what Nav2, its collision monitor, TEB and RViz
    read. Needs no ROS. While anything is missing or late it publishes a stop and says why. See
    docs/nav2.md for the parameters to set in Nav2.
    """
    from ._run import BridgeOptions, bridge_command  # noqa: PLC0415 - help needs no perception

    return bridge_command(BridgeOptions(**values))
