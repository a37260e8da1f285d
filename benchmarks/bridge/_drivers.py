"""Drivers of a robot on DDS: a camera that sends a rendered image, and odometry."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from nav_adapter.ros2 import PUBLISHED, READ, DdsNode, decode, encode
from nav_adapter.ros2.messages.builtin_interfaces import Time
from nav_adapter.ros2.messages.diagnostic_msgs import DiagnosticArray
from nav_adapter.ros2.messages.geometry_msgs import (
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo, CompressedImage, Image
from nav_adapter.ros2.messages.std_msgs import Header
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import Camera
from sim_tests import SimError

# Short enough that the adapter's odometry is never stale, whatever the rate of the images.
_ODOMETRY_PERIOD_S = 0.02
_SPEED_MPS = 0.5


class RobotDrivers:
    """Sends what a robot's drivers send, and receives what its planners would.

    Args:
        folder: output of ``awarenav render``.
        domain: DDS domain.
        compressed: send JPEG files instead of pixels.
    """

    def __init__(self, folder: Path, domain: int, compressed: bool) -> None:
        frame = _first_frame(folder)
        self.node = DdsNode(domain)
        self._image = READ["compressed" if compressed else "image"]
        # Best effort, as camera drivers send images: lost parts of a reliable image would hold up
        # the next one for a reader that does not ask for them again.
        self.node.advertise(self._image)
        for topic in (READ["camera_info"], READ["odom"], READ["tf_static"]):
            self.node.advertise(replace(topic, reliable=True))
        for topic in PUBLISHED.values():
            self.node.subscribe(topic)
        self.people = len(frame["people"])
        pixels = cv2.imread(str(folder / frame["frame"]))
        self._shape = pixels.shape
        # Two pictures in turn, as the one before again is no view.
        self._pictures: list[bytes] = []
        for corner in (0, 255):
            pixels[:8, :8] = corner
            self._pictures.append(
                cv2.imencode(".jpg", pixels)[1].tobytes() if compressed else pixels.tobytes()
            )
        self._compressed = compressed
        self._camera = Camera.from_yaml(folder / "camera.yaml")
        self._T_base_camera = np.array(frame["T_odom_camera"])
        self._odometry_due_s = 0.0

    def close(self) -> None:
        """Leave the domain."""
        self.node.close()

    def send_calibration(self) -> None:
        """Send the camera's mount (static transform) and its calibration."""
        T = self._T_base_camera
        turn = Quaternion(*Rotation.from_matrix(T[:3, :3]).as_quat().tolist())
        mount = Transform(Vector3(*T[:3, 3].tolist()), turn)
        transform = TransformStamped(Header(frame_id="base_link"), "camera", mount)
        self.node.publish(READ["tf_static"], TFMessage((transform,)))
        size = self._camera.height_px, self._camera.width_px
        k = tuple(self._camera.matrix.ravel().tolist())
        info = CameraInfo(_header("camera"), *size, "plumb_bob", (), k)
        self.node.publish(READ["camera_info"], info)

    def send_image(self) -> None:
        """Send odometry, then the image."""
        self.send_odometry()
        self._pictures.reverse()
        data = self._pictures[0]
        if self._compressed:
            message: Image | CompressedImage = CompressedImage(_header("camera"), "jpeg", data)
        else:
            height, width, _ = self._shape
            message = Image(_header("camera"), height, width, "bgr8", 0, 3 * width, data)
        self.node.publish_cdr(self._image, encode(message))

    def send_odometry(self) -> None:
        """Send odometry."""
        twist = TwistWithCovariance(Twist(Vector3(_SPEED_MPS, 0.0, 0.0)))
        self.node.publish(READ["odom"], Odometry(_header("odom"), "base_link", twist=twist))
        self._odometry_due_s = time.monotonic() + _ODOMETRY_PERIOD_S

    def receive_until(self, until_s: float) -> list[tuple[float, int]]:
        """Receive until a time (monotonic, s), and return when each publication came.

        With each is the number of frames that the bridge has processed, from its diagnostics.
        Odometry is sent meanwhile. Every topic is read, so that the bridge sends every message.
        """
        received = []
        while (left_s := until_s - time.monotonic()) > 0.0:
            self.node.wait(min(left_s, max(0.0, self._odometry_due_s - time.monotonic())))
            now = time.monotonic()
            for key, topic in PUBLISHED.items():
                came = self.node.take_cdr(topic)
                if key == "alerts":
                    received += [(now, _frames(cdr)) for cdr in came]
            if now >= self._odometry_due_s:
                self.send_odometry()
        return received


def _first_frame(folder: Path) -> dict[str, Any]:
    file = folder / "truth.jsonl"
    try:
        frame: dict[str, Any] = json.loads(file.read_text().splitlines()[0])
    except (OSError, IndexError, ValueError) as cause:
        raise SimError(f"{file} is not what `awarenav render` writes: {cause}") from cause
    return frame


def _frames(cdr: bytes) -> int:
    """Return the number of frames from the diagnostics of a publication, 0 in the last one."""
    state = decode(DiagnosticArray, cdr).status[0]
    return next((int(pair.value) for pair in state.values if pair.key == "frames"), 0)


def _header(frame_id: str) -> Header:
    sec, nanosec = divmod(time.time_ns(), 1_000_000_000)
    return Header(Time(sec, nanosec), frame_id)
