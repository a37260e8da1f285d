"""Image topics of ROS 1 and ROS 2 recordings."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from nav_adapter import NavError
from nav_adapter.ros2 import (
    TransformBuffer,
    camera_of,
    is_rectified,
    optical_problem,
    picture_of,
)
from nav_adapter.ros2.conversions import from_ros
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import Camera
from perception.arrays import ImageRgb

from ..errors import AwarenavError
from ._bag import open_bag, read_messages, topic_name
from ._source import SourceFrame

_IMAGE: Final = "sensor_msgs/msg/Image"
_COMPRESSED: Final = "sensor_msgs/msg/CompressedImage"
_INFO: Final = "sensor_msgs/msg/CameraInfo"
_TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"
# By then every mount has been sent.
_MOST_TRANSFORMS: Final = 1000


class BagSource:
    """One image topic of a recording: rosbag2 folder, ``.db3``, ``.mcap``, or a ROS 1 ``.bag``.

    The stamp of a frame is that of its message's header. The ``camera_info`` topic beside the
    images is their camera; the topic's name tells whether they are rectified.

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
            self._connections = self._of(self._topic, _IMAGE, _COMPRESSED)
            self.rectified = is_rectified(self._topic)
            shown = None
            with contextlib.suppress(AwarenavError):  # a damaged image is told with its frame
                shown = self._first(self._connections)
            try:
                self._camera: Camera | AwarenavError | None = self._read_camera(shown)
            except AwarenavError as refusal:  # only if nobody gives another calibration
                self._camera = refusal
            self.notes = tuple(filter(None, [self._frame_note(shown)]))
        except BaseException:
            self._reader.close()
            raise
        self.count: int | None = sum(each.msgcount for each in self._connections) or None
        duration_s = self._reader.duration * 1.0e-9
        self.rate_hz: float | None = None
        if self.count is not None and self.count > 1 and duration_s > 0.0:
            self.rate_hz = (self.count - 1) / duration_s
        self.live = False
        self.rendered = False

    @property
    def camera(self) -> Camera | None:
        """The camera of ``camera_info``; None without one, or from an uncalibrated driver.

        Raises:
            AwarenavError: for a calibration that cannot be used.
        """
        if isinstance(self._camera, AwarenavError):
            raise self._camera
        return self._camera

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

    def _read_camera(self, shown: Any) -> Camera | None:
        """Return the camera of the first ``camera_info`` message in the images' namespace."""
        size_px = None
        with contextlib.suppress(AwarenavError):
            if shown is not None:
                height_px, width_px = picture_of(shown).shape[:2]
                size_px = (width_px, height_px)
        parts = topic_name(self._topic).split("/")
        topics = [
            "/".join(parts[:length]) + "/camera_info" for length in range(len(parts) - 1, 0, -1)
        ]
        for topic in topics[:2]:  # beside image_raw, or beside the parent of image_raw/compressed
            info = self._first(self._of(topic, _INFO))
            if info is None:
                continue
            if _is_zero(info, "kK") and not (self.rectified and not _is_zero(info, "pP")):
                return None
            try:
                return camera_of(info, rectified=self.rectified, image_size_px=size_px)
            except NavError as cause:
                raise AwarenavError(f"{topic}: {cause}") from cause
        return None

    def _frame_note(self, shown: Any) -> str:
        """Return why the frame of the images is not optical by the transforms, if so.

        Mounts are in /tf_static, those of ROS 1 in /tf, and both may have a namespace.
        """
        transforms = TransformBuffer()
        known = [each for each in self._reader.connections if each.msgtype == _TRANSFORMS]
        static = [each for each in known if each.topic.endswith("_static")]
        # Damaged transforms, and those of ROS 1 with other fields, tell nothing.
        with contextlib.suppress(ValueError, TypeError, AttributeError):
            frame = str(shown.header.frame_id).lstrip("/")
            for connections in (static, [each for each in known if each not in static]):
                sent = read_messages(self._path, self._reader, connections)
                for _, _, message in islice(sent, _MOST_TRANSFORMS):
                    for each in from_ros(TFMessage, message).transforms:
                        transforms.add_message(each, static=True)
                if (root := transforms.root(frame)) != frame:
                    return optical_problem(transforms.lookup(root, frame, 0.0), frame, root)
        return ""

    def _of(self, topic: str, *kinds: str) -> list[Any]:
        """Return the connections of a topic."""
        found = self._reader.connections
        name = topic_name(topic)
        return [each for each in found if topic_name(each.topic) == name and each.msgtype in kinds]

    def _first(self, connections: list[Any]) -> Any:
        """Return the first message of some connections; None if there is none."""
        found = next(read_messages(self._path, self._reader, connections), None)
        return None if found is None else found[2]


def _is_zero(info: Any, names: str) -> bool:
    """Return whether a matrix is zero, as an uncalibrated driver sends it; in capitals in ROS 1."""
    return not any(np.any(getattr(info, name, 0.0)) for name in names)


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
