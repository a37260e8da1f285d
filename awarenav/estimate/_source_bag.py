"""Image topics of ROS 1 and ROS 2 recordings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import NavError
from nav_adapter.ros2 import camera_of, picture_of
from nav_adapter.ros2.messages.sensor_msgs import CameraInfo
from perception import Camera
from perception.arrays import ImageRgb

from ..errors import AwarenavError
from ._bag import open_bag, topic_name
from ._source import SourceFrame

_IMAGE: Final = "sensor_msgs/msg/Image"
_COMPRESSED: Final = "sensor_msgs/msg/CompressedImage"
_INFO: Final = "sensor_msgs/msg/CameraInfo"


class BagSource:
    """One image topic of a recording: rosbag2 folder, ``.db3``, ``.mcap``, or a ROS 1 ``.bag``.

    The stamp of a frame is that of its message's header. The ``camera_info`` topic beside the
    images is their camera.

    Args:
        path: of the recording.
        topic: of the images (sensor_msgs Image or CompressedImage); None if there is only one.

    Raises:
        AwarenavError: for a file that is not a recording, or a topic that it does not have.
    """

    def __init__(self, path: Path, topic: str | None = None) -> None:
        self._path = path
        self._reader = open_bag(path)
        try:
            self._topic = self._chosen_topic(topic)
            self.camera = self._read_camera()
        except BaseException:
            self._reader.close()
            raise
        self._connections = [each for each in self._reader.connections if each.topic == self._topic]
        self.count: int | None = sum(each.msgcount for each in self._connections) or None
        duration_s = self._reader.duration * 1.0e-9
        self.rate_hz: float | None = None
        if self.count is not None and self.count > 1 and duration_s > 0.0:
            self.rate_hz = (self.count - 1) / duration_s
        self.live = False
        self.rendered = False

    def frames(self) -> Iterator[SourceFrame]:
        """Yield the images of the topic, numbered from 000000."""
        messages = self._reader.messages(connections=self._connections)
        last_s, number = -math.inf, 0
        while True:
            name = f"{number:06d}"
            try:
                connection, recorded_ns, raw = next(messages)
                message: Any = self._reader.deserialize(raw, connection.msgtype)
            except StopIteration:
                return
            except Exception as cause:
                problem = f"{self._path}, message {number}: {cause}; the rest cannot be read"
                yield SourceFrame(name, max(last_s, 0.0), None, None, problem)
                return
            stamp_s = _stamp_s(message)
            if stamp_s is None:
                stamp_s = recorded_ns * 1.0e-9
            last_s = stamp_s
            try:
                image = _rgb_image(message, f"{self._topic}, message {number}")
                yield SourceFrame(name, stamp_s, image)
            except AwarenavError as error:
                yield SourceFrame(name, stamp_s, None, None, str(error))
            number += 1

    def close(self) -> None:
        """Close the recording."""
        self._reader.close()

    def _chosen_topic(self, topic: str | None) -> str:
        """Return the image topic that was asked for, or the only one."""
        images: list[str] = sorted(
            {
                each.topic
                for each in self._reader.connections
                if each.msgtype in (_IMAGE, _COMPRESSED)
            }
        )
        if not images:
            raise AwarenavError(f"{self._path} has no topic of type {_IMAGE} or {_COMPRESSED}")
        if topic is not None:
            # Recordings of ROS 1 may lack the leading slash.
            same = [each for each in images if topic_name(each) == topic_name(topic)]
            if not same:
                raise AwarenavError(f"--topic must be one of {', '.join(images)}, got {topic}")
            return same[0]
        if len(images) > 1:
            raise AwarenavError(
                f"{self._path} has several image topics: choose --topic {' | '.join(images)}"
            )
        return images[0]

    def _read_camera(self) -> Camera | None:
        """Return the camera of the first ``camera_info`` message in the images' namespace."""
        parts = topic_name(self._topic).split("/")
        topics = [
            "/".join(parts[:length]) + "/camera_info" for length in range(len(parts) - 1, 0, -1)
        ]
        for topic in topics[:2]:  # beside image_raw, or beside the parent of image_raw/compressed
            connections = [
                each
                for each in self._reader.connections
                if topic_name(each.topic) == topic and each.msgtype == _INFO
            ]
            for connection, _, raw in (
                self._reader.messages(connections=connections) if connections else ()
            ):
                message: Any = self._reader.deserialize(raw, connection.msgtype)
                return _camera(message, topic)
        return None


def _camera(message: Any, topic: str) -> Camera | None:
    """Return the camera of a ``camera_info`` message; None from an uncalibrated driver."""
    # ROS 1 names the matrices in capitals. An uncalibrated driver sends zeros.
    matrix = np.asarray(getattr(message, "k", getattr(message, "K", ())), dtype=float).reshape(-1)
    distortion = np.asarray(getattr(message, "d", getattr(message, "D", ())), dtype=float)
    if matrix.size != 9 or not matrix[0] > 0.0:
        return None
    info = CameraInfo(
        height=int(message.height),
        width=int(message.width),
        distortion_model=str(message.distortion_model),
        d=tuple(distortion.tolist()),
        k=tuple(matrix.tolist()),
    )
    try:
        return camera_of(info)
    except NavError as cause:
        raise AwarenavError(f"{topic}: {cause}") from cause


def _stamp_s(message: Any) -> float | None:
    """Return the header's stamp; None for zero, which a driver without a clock sends."""
    stamp = message.header.stamp
    seconds = float(stamp.sec) + 1.0e-9 * float(stamp.nanosec)
    return seconds if seconds > 0.0 else None


def _rgb_image(message: Any, name: str) -> ImageRgb:
    """Return the image of a message as RGB."""
    try:
        return picture_of(message)
    except NavError as cause:
        raise AwarenavError(f"{name}: {cause}") from cause
