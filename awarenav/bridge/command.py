"""The command ``awarenav bridge``."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Final

from ..cli import NUMBER, FilePath, Number, Whole, command, option, options

_READ: Final = "Topics to read"
_WRITE: Final = "Topics to publish"
_LOG: Final = "Recordings"


@command(
    "bridge",
    examples=[
        "awarenav bridge --robot robot.yaml --scan scan_front --scan scan_rear",
        "awarenav bridge --robot robot.yaml --detector yolox-tiny --pose rtmpose-m",
        "awarenav bridge --robot robot.yaml --scan scan --prediction prediction.yaml",
        "awarenav bridge --robot robot.yaml --no-camera --scan scan_front --scan scan_rear",
        "awarenav bridge --robot robot.yaml --no-camera --scan scan --bag drive --record seen.mcap",
    ],
    exit_status={0: "Ended by Ctrl-C, SIGTERM or --seconds.", 2: "Bad input."},
    epilog="The environment variable CYCLONEDDS_URI chooses the network interface, as with "
    "rmw_cyclonedds_cpp. Needs the extra 'ros2'.",
)
@option(
    "--robot",
    type=FilePath(),
    required=True,
    metavar="FILE",
    help="Footprint, speeds, braking and mounts of the sensors (YAML, as docs/nav2/robot.yaml).",
)
@options.policy()
@option(
    "--prediction",
    type=FilePath(),
    show_default="none",
    metavar="FILE",
    help="Prediction calibrated on your own recordings, as `awarenav tracks calibrate` writes it: "
    "for polygons with sweep_s, alerts and the speed mask.",
)
@option(
    "--domain",
    type=Whole(0, 232),
    show_default="$ROS_DOMAIN_ID, or 0",
    metavar="N",
    help="DDS domain.",
)
@option(
    "--rate",
    type=Number(1.0, 200.0),
    default=20.0,
    metavar="HZ",
    help="Rate of publishing, however long perception takes for an image.",
)
@option("--seconds", type=Number(0.0), metavar="S", help="End after this time.")
@options.networks
@options.allow_simulator_networks()
@options.running
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
    "--depth",
    group=_READ,
    metavar="TOPIC",
    help="sensor_msgs/Image of depth, aligned with the images: 16UC1 in mm or 32FC1 in m.",
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
    help="Calibration (ROS camera_info YAML) instead of the topic.",
)
@option(
    "--scan",
    group=_READ,
    many=True,
    metavar="TOPIC...",
    help="sensor_msgs/LaserScan of one or two laser scanners; repeat the option for the second.",
)
@option(
    "--no-camera",
    group=_READ,
    is_flag=True,
    help="Use only scanners: everybody counts as unaware.",
)
@option(
    "--map",
    group=_READ,
    metavar="TOPIC|FILE.yaml",
    help="nav_msgs/OccupancyGrid, or a map file of map_server. What is in the map is not taken "
    "for legs. Needs --scan.",
)
@option(
    "--map-frame",
    group=_READ,
    default="map",
    metavar="FRAME",
    help="Frame in tf of the map in a file; the fixed frame itself needs no tf.",
)
@option(
    "--footprint",
    group=_READ,
    metavar="TOPIC",
    help="geometry_msgs/PolygonStamped of the footprint with a load, as Nav2 publishes it on "
    "local_costmap/published_footprint. It counts beside that of the robot file.",
)
@option(
    "--bag",
    group=_READ,
    type=FilePath(),
    metavar="FILE",
    help="Replay a recording (rosbag2 folder, .db3, .mcap, .bag) instead; nothing is published.",
)
@option("--odom", group=_READ, default="odom", metavar="TOPIC", help="nav_msgs/Odometry.")
@option(
    "--tf",
    group=_READ,
    default="tf",
    metavar="TOPIC",
    help="tf2_msgs/TFMessage, such as robot1/tf; static transforms are then in robot1/tf_static.",
)
@option("--odom-frame", group=_READ, default="odom", metavar="FRAME", help="Fixed frame in tf.")
@option("--base-frame", group=_READ, default="base_link", metavar="FRAME", help="Robot's frame.")
@option(
    "--camera-frame",
    group=_READ,
    default="",
    show_default="the frame in the images",
    metavar="FRAME",
    help="Optical frame in tf; not used if the robot file has a camera mount.",
)
@option(
    "--topic",
    group=_WRITE,
    many=True,
    metavar="KEY=TOPIC...",
    help="Publish under another name, such as speed_limit=robot1/speed_limit.",
)
@option(
    "--only",
    group=_WRITE,
    many=True,
    show_default="all",
    metavar="KEY...",
    help="Publish only these: speed_limit collision_polygons stop_zone grid circles obstacles "
    "people detections markers alerts; with --speed-mask also speed_mask speed_mask_info.",
)
@option(
    "--percentage",
    group=_WRITE,
    is_flag=True,
    help="Send the speed limit in per cent of the robot's maximum speed, not in m/s.",
)
@option(
    "--speed-mask",
    group=_WRITE,
    type=NUMBER,
    show_default="no mask",
    metavar="HZ",
    help="Publish the speed limit around the robot at this rate, as the mask of Nav2's speed "
    "filter, 0.1 to 50. docs/nav2.md says how to set up the filter.",
)
@option(
    "--speed-mask-size",
    group=_WRITE,
    type=NUMBER,
    default=10.0,
    metavar="M",
    help="Side of the mask's square around the robot.",
)
@option(
    "--speed-mask-resolution",
    group=_WRITE,
    type=NUMBER,
    default=0.1,
    metavar="M",
    help="Side of the mask's cells.",
)
@option(
    "--record",
    group=_LOG,
    type=FilePath(),
    metavar="FILE.mcap",
    help="Record what is published, and odometry, tf and scans as read, for Foxglove.",
)
@option(
    "--rerun",
    group=_LOG,
    type=FilePath(),
    metavar="FILE.rrd",
    help="Record images, keypoints, cones, tracks, radii and speed for Rerun (needs the extra "
    "'viz').",
)
def bridge(**values: Any) -> int:
    """Find and track people with a ROS 2 camera; publish obstacles and a speed limit for Nav2.

    Reads images, calibration, scans and odometry. Publishes what Nav2, its collision monitor, TEB
    and RViz read. Needs no ROS. While an input is missing or late, the bridge publishes a stop and
    the reason. docs/nav2.md has the parameters to set in Nav2.
    """
    from ._run import bridge_command  # noqa: PLC0415 - help needs no perception

    return bridge_command(SimpleNamespace(**values))
