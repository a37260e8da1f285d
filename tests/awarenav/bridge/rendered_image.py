"""A rendered image with a person, as the messages of a robot that stands still."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from awarenav.cli import main
from nav_adapter.ros2.conversions import to_time
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
from perception.arrays import FloatArray


def stamped(stamp_s: float, frame_id: str) -> Header:
    return Header(to_time(stamp_s), frame_id)


class RenderedImage:
    """A rendered image with one person, and its messages."""

    def __init__(self, folder: Path) -> None:
        lines = (folder / "truth.jsonl").read_text().splitlines()
        frame = next(line for line in map(json.loads, lines) if len(line["people"]) == 1)
        self.bgr = cv2.imread(str(folder / frame["frame"]))
        self.camera = Camera.from_yaml(folder / "camera.yaml")
        self.T_base_camera: FloatArray = np.array(frame["T_odom_camera"])
        (truth,) = frame["people"]
        self.place_m = (self.T_base_camera @ [*truth["position_camera_m"], 1.0])[:2]

    def image(self, stamp_s: float) -> Image:
        self._take()
        height, width, _ = self.bgr.shape
        header = stamped(stamp_s, "camera")
        return Image(header, height, width, "bgr8", 0, 3 * width, self.bgr.tobytes())

    def compressed(self, stamp_s: float) -> CompressedImage:
        self._take()
        data = cv2.imencode(".png", self.bgr)[1].tobytes()
        return CompressedImage(stamped(stamp_s, "camera"), "png", data)

    def _take(self) -> None:
        """Change a pixel: no two pictures of a camera are the same to the bit."""
        self.bgr[0, 0, 0] = (int(self.bgr[0, 0, 0]) + 1) % 256

    def info(self, stamp_s: float) -> CameraInfo:
        k = tuple(self.camera.matrix.ravel().tolist())
        size = self.camera.height_px, self.camera.width_px
        return CameraInfo(stamped(stamp_s, "camera"), *size, "plumb_bob", (), k)

    def mounted(self) -> TFMessage:
        turn = Rotation.from_matrix(self.T_base_camera[:3, :3]).as_quat().tolist()
        place = Vector3(*self.T_base_camera[:3, 3].tolist())
        header = Header(frame_id="base_link")
        return TFMessage((TransformStamped(header, "camera", Transform(place, Quaternion(*turn))),))


def odometry(stamp_s: float) -> Odometry:
    twist = TwistWithCovariance(Twist(Vector3(0.5, 0.0, 0.0)))
    return Odometry(stamped(stamp_s, "odom"), "base_link", twist=twist)


def rendered(folder: Path) -> RenderedImage:
    size = ["--frames", "2", "--people", "1", "--scenes", "1", "--range", "2", "4", "--seed", "3"]
    assert main(["render", *size, "--workers", "1", "--out", str(folder)]) == 0
    return RenderedImage(folder)
