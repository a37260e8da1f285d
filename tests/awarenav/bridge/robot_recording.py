"""Messages of a robot that stands still, with one scanner and perhaps a camera."""

from __future__ import annotations

import os

import numpy as np
from scan_scenes import scan_message

from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.geometry_msgs import Transform, TransformStamped, Vector3
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, Image
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage

START_S, PERIOD_S, PERSON = 1000.0, 0.04, (2.5, 1.2)
MOUNTED = TFMessage(
    (TransformStamped(Header(frame_id="base_link"), "scanner", Transform(Vector3(0.3, 0.0, 0.2))),)
)
K = (50.0, 0.0, 32.0, 0.0, 50.0, 24.0, 0.0, 0.0, 1.0)
#: The depth image of this tick is of a kind that cannot be read.
BAD_DEPTH = 10


def messages(
    prefix: str = "/",
    *,
    ticks: int = 75,
    stamps_s: float = START_S,
    back_s: float = 0.0,
    static_s: float = START_S,
    camera: bool = False,
    depth: bool = False,
) -> list[tuple[str, float, Message]]:
    """Return topic, time of recording and message, in their order.

    Args:
        prefix: of the names of topics.
        ticks: number of scans.
        stamps_s: of the first message; its time of recording is 1000 s.
        back_s: so far the stamps go back in the middle.
        static_s: time of recording of the mounts.
        camera: adds pictures and their calibration.
        depth: adds depth images, each after its picture.
    """
    found: list[tuple[str, float, Message]] = [(f"{prefix}tf_static", static_s, MOUNTED)]
    for tick in range(ticks):
        at_s = START_S + PERIOD_S * tick
        stamp_s = stamps_s + PERIOD_S * tick - (back_s if 2 * tick >= ticks else 0.0)
        found.append(
            (f"{prefix}odom", at_s, Odometry(Header(to_time(stamp_s), "odom"), "base_link"))
        )
        found.append((f"{prefix}scan", at_s + 0.01, scan_message(stamp_s, [PERSON])))
        header = Header(to_time(stamp_s), "camera")
        if camera:
            picture = Image(header, 48, 64, "rgb8", 0, 192, os.urandom(48 * 192))
            found.append(("/camera/camera_info", at_s, CameraInfo(header, 48, 64, k=K)))
            found.append(("/camera/image_raw", at_s + 0.01, picture))
        if depth:
            encoding, kind = ("mono8", "u1") if tick == BAD_DEPTH else ("16UC1", "<u2")
            far = np.full((48, 64), 30 if tick == BAD_DEPTH else 3000 + tick, kind)
            sent = Image(header, 48, 64, encoding, 0, 64 * far.itemsize, far.tobytes())
            found.append(("/camera/depth", at_s + 0.03, sent))
    return sorted(found, key=lambda each: each[1])
