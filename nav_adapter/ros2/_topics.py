"""The topics of the bridge: names, types and quality of service."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from .._errors import NavError
from .messages import Message
from .messages.costmap_converter_msgs import ObstacleArrayMsg
from .messages.diagnostic_msgs import DiagnosticArray
from .messages.geometry_msgs import PolygonInstanceStamped, PolygonStamped
from .messages.nav2_msgs import CircleObject, CostmapFilterInfo, SpeedLimit
from .messages.nav_msgs import OccupancyGrid, Odometry
from .messages.people_msgs import People
from .messages.sensor_msgs import CameraInfo, CompressedImage, Image, LaserScan
from .messages.tf2_msgs import TFMessage
from .messages.vision_msgs import Detection3DArray
from .messages.visualization_msgs import MarkerArray


@dataclass(frozen=True)
class Topic:
    """One topic and its quality of service.

    Attributes:
        name: ROS name without a leading slash.
        message: type of the messages.
        reliable: True for reliable, False for best effort. A reliable publisher matches every
            subscriber.
        transient_local: True if late subscribers get the last message, False for volatile.
        depth: number of messages kept.
    """

    name: str
    message: type[Message]
    reliable: bool = True
    transient_local: bool = False
    depth: int = 10


#: The topics that the bridge publishes, by key.
PUBLISHED: Final = MappingProxyType(
    {
        "speed_limit": Topic("speed_limit", SpeedLimit),
        "collision_polygons": Topic(
            "awarenav/collision_polygons", PolygonInstanceStamped, depth=64
        ),
        "stop_zone": Topic("awarenav/stop_zone", PolygonStamped, depth=1),
        "grid": Topic("awarenav/people_grid", OccupancyGrid, transient_local=True, depth=1),
        "circles": Topic("awarenav/circles", CircleObject, depth=64),
        "obstacles": Topic("obstacles", ObstacleArrayMsg, depth=1),
        "people": Topic("people", People, depth=1),
        "detections": Topic("awarenav/detections", Detection3DArray, depth=1),
        "markers": Topic("awarenav/markers", MarkerArray, depth=1),
        # Each alert and answer is in one message only, so the depth covers two seconds and more.
        "alerts": Topic("awarenav/alerts", DiagnosticArray, depth=64),
    }
)

#: The topics of the speed mask, which the bridge publishes if it is asked to, by key.
MASK_TOPICS: Final = MappingProxyType(
    {
        "speed_mask": Topic("awarenav/speed_mask", OccupancyGrid, transient_local=True, depth=1),
        "speed_mask_info": Topic(
            "awarenav/speed_mask_info", CostmapFilterInfo, transient_local=True, depth=1
        ),
    }
)

#: The topics that the bridge reads, by key. Best effort matches every publisher.
READ: Final = MappingProxyType(
    {
        "image": Topic("camera/image_raw", Image, reliable=False, depth=1),
        "compressed": Topic(
            "camera/image_raw/compressed", CompressedImage, reliable=False, depth=1
        ),
        "depth": Topic("camera/depth_registered/image_raw", Image, reliable=False, depth=2),
        "camera_info": Topic("camera/camera_info", CameraInfo, reliable=False, depth=1),
        "scan": Topic("scan", LaserScan, reliable=False),
        "scan_2": Topic("scan_2", LaserScan, reliable=False),
        "map": Topic("map", OccupancyGrid, transient_local=True, depth=1),
        "footprint": Topic(
            "local_costmap/published_footprint", PolygonStamped, reliable=False, depth=1
        ),
        "odom": Topic("odom", Odometry, reliable=False, depth=50),
        "tf": Topic("tf", TFMessage, reliable=False, depth=100),
        "tf_static": Topic("tf_static", TFMessage, transient_local=True, depth=100),
    }
)


# Last parts of the topics of image_transport.
_TRANSPORTS: Final = ("compressed", "compressedDepth", "theora", "ffmpeg", "zstd")
# Words in the name of a topic of rectified images.
_RECTIFIED: Final = {"rect", "rectified", "undistorted"}


def is_rectified(topic: str) -> bool:
    """Return whether a topic of images has rectified ones, by its name.

    ``image_proc`` and the drivers say so in the last part: ``image_rect``, ``image_rect_color``,
    ``left/image_rect/compressed``; before a mere ``image``, in the one before: ``rect/image``.
    """
    parts = [part.lower() for part in topic.split("/") if part and part not in _TRANSPORTS]
    named = parts[-2:] if parts[-1:] == ["image"] else parts[-1:]
    return not _RECTIFIED.isdisjoint(word for part in named for word in part.split("_"))


def renamed(topic: Topic, name: str) -> Topic:
    """Return the topic with another name, as written in ROS (``/robot1/odom``).

    Raises:
        NavError: for a name that ROS does not allow.
    """
    bare = name.strip("/")
    parts = bare.split("/")
    if not all(
        part.isascii() and part.replace("_", "a").isalnum() and not part[0].isdigit()
        for part in parts
    ):
        raise NavError(
            "a topic must consist of letters, digits, _ and /, with no part starting with a digit, "
            f"got {name!r}"
        )
    return replace(topic, name=bare)
