"""Messages and images of ROS 1 and ROS 2 recordings; no other module imports ``rosbags``."""

from __future__ import annotations

import contextlib
import re
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
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
from nav_adapter.ros2.conversions import from_ros, pose_matrix, to_seconds
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.tf2_msgs import TFMessage
from perception import Camera
from perception.arrays import FloatArray
from perception.documents import read_yaml
from perception.installation import install_command

from ..errors import AwarenavError, MissingExtraError
from ._sources import ImageSource, SourceFrame

try:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingExtraError(
        "reading recordings needs the package rosbags, which is not installed; it is the extra "
        f"'rosbag': {install_command('rosbag')}"
    ) from cause


_IMAGES: Final = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
_INFO: Final = "sensor_msgs/msg/CameraInfo"
_TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"
_ODOMETRY: Final = "nav_msgs/msg/Odometry"
# So long an image waits for the transforms of its time, in recorded time.
_PATIENCE_S: Final = 0.3
# Damaged messages, and those of ROS 1 with other fields, tell nothing.
_UNREADABLE: Final = (ValueError, TypeError, AttributeError)
# By then every mount has been sent.
_MOST_TRANSFORMS: Final = 1000
# What the library says of a file, and its usual cause.
_CAUSES: Final = {
    "end magic": "its recorder was not ended: `mcap recover` makes a readable copy",
    "Header could not be read": "its recorder was not ended: try `rosbag reindex`",
    "not indexed": "its recorder was not ended: `rosbag reindex` writes the index",
    "disk image is malformed": "its recorder was not ended: `sqlite3 FILE .recover`",
    "CDR encapsulation": "compressed messages can be read only with the metadata.yaml beside them",
    "storage format '.zstd'": "a compressed file can be read only with the metadata.yaml beside it",
}


def topic_name(name: str) -> str:
    """Return a topic's name with its leading slash, which recordings of ROS 1 may lack."""
    return f"/{name.strip('/')}"


def open_bag(path: Path) -> Any:
    """Return an open ``rosbags`` reader of a recording.

    Args:
        path: rosbag2 folder, ``.db3``, ``.mcap``, or a ROS 1 ``.bag``. A folder without
            ``metadata.yaml``, or with an empty one, is read as the files in it.

    Raises:
        AwarenavError: for a file that is not a recording.
    """
    files = _files_of(path)
    try:
        reader = AnyReader(files, default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
    # The library also raises errors of its storage layers.
    except Exception as cause:
        raise AwarenavError(f"cannot read the recording {path}: {_explained(cause)}") from cause
    return reader


def _files_of(path: Path) -> list[Path]:
    """Return what the library opens."""
    if not path.exists():
        raise AwarenavError(f"cannot read the recording {path}: there is no such file or folder")
    folder = path if path.is_dir() else path.parent
    if (metadata := folder / "metadata.yaml").is_file() and not _is_blank(metadata):
        # This refuses what would harm the library as well.
        content = read_yaml(metadata, AwarenavError)
        about = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
        names = about.get("relative_file_paths") if isinstance(about, dict) else None
        # Only the metadata tell that a file is compressed.
        return [folder] if path.is_dir() or names == [path.name] else [path]
    if not path.is_dir():
        return [path]
    files = sorted(each for each in path.iterdir() if each.suffix in (".db3", ".mcap", ".bag"))
    if not files:
        raise AwarenavError(
            f"cannot read the recording {path}: the folder has no metadata.yaml, and no .db3, "
            ".mcap or .bag file"
        )
    # The files of a split recording differ in their numbers.
    if len({re.sub(r"_\d+$", "", each.stem) for each in files}) > 1:
        raise AwarenavError(
            f"cannot read the recording {path}: the folder has no metadata.yaml, and holds several "
            f"recordings: give one of {', '.join(each.name for each in files)}"
        )
    return files


def _is_blank(metadata: Path) -> bool:
    """Return whether metadata were never written, as when the robot was switched off."""
    with metadata.open("rb") as file:
        return not file.read(64).strip(b"\0 \r\n")


def _explained(cause: Exception) -> str:
    """Return an error of the library with its usual cause, if that is known."""
    text = str(cause)
    return next((f"{text} ({why})" for said, why in _CAUSES.items() if said in text), text)


class BagMessages:
    """Messages of a recording, in the order in which they were recorded.

    A topic that was recorded without a leading slash, as in ROS 1, is the same one.

    Args:
        path: of the recording, as in :func:`open_bag`.
        required: topics, ``/scan`` or similar, and their types, ``sensor_msgs/msg/LaserScan``.
        optional: topics that the recording may lack.

    Attributes:
        topics: name and type of everything that was recorded.
        duration_s: time from the first to the last message.

    Raises:
        AwarenavError: for a file that is not a recording, or that lacks a required topic.
    """

    def __init__(
        self,
        path: Path,
        required: Mapping[str, str] | None = None,
        optional: Mapping[str, str] | None = None,
    ) -> None:
        self._path, self._reader = path, open_bag(path)
        self._wanted = {**(optional or {}), **(required or {})}
        connections = self._reader.connections
        self.topics = {(topic_name(each.topic), str(each.msgtype)) for each in connections}
        self.duration_s = self._reader.duration * 1.0e-9
        for topic, kind in (required or {}).items():
            if (topic, kind) not in self.topics:
                self._reader.close()
                known = ", ".join(f"{name} ({type_})" for name, type_ in sorted(self.topics))
                raise AwarenavError(
                    f"{path} has no topic {topic} of type {kind}; it has {known or 'none'}"
                )

    def __iter__(self) -> Iterator[tuple[str, float, Any]]:
        """Yield topic, time of recording (s) and message of the required and optional topics.

        Raises:
            AwarenavError: for a message that cannot be read.
        """
        return self._read(
            [
                each
                for each in self._reader.connections
                if self._wanted.get(topic_name(each.topic)) == each.msgtype
            ]
        )

    def of(self, kinds: Collection[str], *topics: str) -> Iterator[tuple[str, float, Any]]:
        """Yield the messages of some types, of some topics or of all, as iterating does.

        Raises:
            AwarenavError: for a message that cannot be read.
        """
        return self._read(self._connections(kinds, topics))

    def first(self, kinds: Collection[str], topic: str) -> Any:
        """Return the first message of a topic; None if there is none.

        Raises:
            AwarenavError: if it cannot be read.
        """
        found = next(self.of(kinds, topic), None)
        return None if found is None else found[2]

    def count(self, kinds: Collection[str], topic: str) -> int:
        """Return the number of messages of a topic; 0 also if the recording does not say it."""
        return sum(each.msgcount for each in self._connections(kinds, [topic]))

    def close(self) -> None:
        """Close the recording."""
        self._reader.close()

    def _connections(self, kinds: Collection[str], topics: Collection[str]) -> list[Any]:
        return [
            each
            for each in self._reader.connections
            if each.msgtype in kinds and (not topics or topic_name(each.topic) in topics)
        ]

    def _read(self, connections: Sequence[Any]) -> Iterator[tuple[str, float, Any]]:
        # The library takes none for all.
        messages = self._reader.messages(connections=connections) if connections else iter(())
        while True:
            try:
                connection, recorded_ns, raw = next(messages)
                message = self._reader.deserialize(raw, connection.msgtype)
            except StopIteration:
                return
            except Exception as cause:
                raise AwarenavError(
                    f"{self._path}: the rest cannot be read: {_explained(cause)}"
                ) from cause
            yield topic_name(connection.topic), recorded_ns / 1e9, message


class BagSource(ImageSource):
    """One image topic of a recording: rosbag2 folder, ``.db3``, ``.mcap``, or a ROS 1 ``.bag``.

    The stamp of a frame is that of its message's header. The ``camera_info`` topic beside the
    images is their camera; the topic's name tells whether they are rectified. A frame has the
    camera's pose in odom where transforms, or the odometry, tell it.

    Args:
        path: of the recording.
        topic: of the images (sensor_msgs Image or CompressedImage); None if there is only one.

    Raises:
        AwarenavError: for a file that is not a recording, or a topic that it does not have.
    """

    def __init__(self, path: Path, topic: str | None = None) -> None:
        self._path, self._bag = path, BagMessages(path)
        try:
            self._topic = self._chosen_topic(topic)
            self.rectified = is_rectified(self._topic)
            shown = None
            with contextlib.suppress(AwarenavError):  # a damaged image is told with its frame
                shown = self._bag.first(_IMAGES, self._topic)
            try:
                self._camera: Camera | AwarenavError | None = self._read_camera(shown)
            except AwarenavError as refusal:  # only if nobody gives another calibration
                self._camera = refusal
            self._read_mount(shown)
        except BaseException:
            self._bag.close()
            raise
        self.count = self._bag.count(_IMAGES, self._topic) or None
        if self.count is not None and self.count > 1 and self._bag.duration_s > 0.0:
            self.rate_hz = (self.count - 1) / self._bag.duration_s

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
        last_s, number = 0.0, 0
        try:
            for recorded_s, message, pose in self._posed():
                # A driver without a clock sends zero.
                stamp_s = to_seconds(message.header.stamp)
                last_s = stamp_s if stamp_s > 0.0 else recorded_s
                name, image, problem = f"{number:06d}", None, ""
                try:
                    image = picture_of(message)
                except NavError as cause:
                    problem = f"{self._topic}, message {number}: {cause}"
                yield SourceFrame(name, last_s, image, pose, on_robot=True, problem=problem)
                number += 1
        except AwarenavError as cause:
            yield SourceFrame(f"{number:06d}", max(last_s, 0.0), None, problem=str(cause))

    def close(self) -> None:
        """Close the recording."""
        self._bag.close()

    def _posed(self) -> Iterator[tuple[float, Any, FloatArray | None]]:
        """Yield time of recording and message of each image, with the camera's pose in odom."""
        kinds = {name: kind for name, kind in self._bag.topics if kind in (_TRANSFORMS, _ODOMETRY)}
        static = [name for name in kinds if name.endswith("_static")]
        moving = [name for name in kinds if name not in static]
        poses = _Poses()
        for _, _, message in self._bag.of([_TRANSFORMS], *static) if static else ():
            poses.add(message, static=True)
        waiting: deque[tuple[float, Any]] = deque()
        wanted, damage = (*_IMAGES, _TRANSFORMS, _ODOMETRY), None
        try:
            for topic, recorded_s, message in self._bag.of(wanted, self._topic, *moving):
                if topic == self._topic:
                    waiting.append((recorded_s, message))
                elif kinds[topic] == _TRANSFORMS:
                    poses.add(message)
                else:
                    poses.add_odometry(message)
                while waiting and (
                    recorded_s - waiting[0][0] > _PATIENCE_S or poses.reach(waiting[0][1].header)
                ):
                    at_s, image = waiting.popleft()
                    yield at_s, image, poses.of(image.header)
        except AwarenavError as cause:
            damage = cause
        for at_s, image in waiting:
            yield at_s, image, poses.of(image.header)
        if damage is not None:
            raise damage

    def _chosen_topic(self, topic: str | None) -> str:
        """Return the image topic that was asked for, or the only one."""
        images = sorted({name for name, kind in self._bag.topics if kind in _IMAGES})
        if not images:
            raise AwarenavError(f"{self._path} has no topic of type {' or '.join(_IMAGES)}")
        if topic is not None:
            if topic_name(topic) not in images:
                raise AwarenavError(f"--topic must be one of {', '.join(images)}, got {topic}")
            return topic_name(topic)
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
        parts = self._topic.split("/")
        topics = [
            "/".join(parts[:length]) + "/camera_info" for length in range(len(parts) - 1, 0, -1)
        ]
        near = topics[:2]  # beside image_raw, or beside the parent of image_raw/compressed
        others = sorted({name for name, kind in self._bag.topics if kind == _INFO} - set(near))
        near += self._under_another_name(others, shown)
        for topic in near:
            info = self._bag.first([_INFO], topic)
            if info is None:
                continue
            if _is_zero(info, "kK") and not (self.rectified and not _is_zero(info, "pP")):
                return None
            try:
                return camera_of(info, rectified=self.rectified, image_size_px=size_px)
            except NavError as cause:
                raise AwarenavError(f"{topic}: {cause}") from cause
        if others:
            self.notes = (
                f"no camera_info lies beside {self._topic}, and calibrations are in "
                f"{', '.join(others)}: write that of this camera into a file and give --camera",
            )
        return None

    def _under_another_name(self, infos: list[str], shown: Any) -> list[str]:
        """Return the only calibration beside the images that is of their frame, or none.

        Drivers call it ``camera_info_rect`` or ``info``, too.
        """
        namespace = self._topic.removesuffix("/compressed").rpartition("/")[0]
        found = []
        for name in infos:
            info = self._bag.first([_INFO], name) if name.rpartition("/")[0] == namespace else None
            if info is not None and shown is not None:
                found += [name] * (info.header.frame_id == shown.header.frame_id)
        return found if len(found) == 1 else []

    def _read_mount(self, shown: Any) -> None:
        """Take from the transforms which way is up, or note that the frame is not optical.

        Mounts are in /tf_static, those of ROS 1 in /tf, and both may have a namespace.
        """
        transforms = TransformBuffer()
        topics = sorted(name for name, kind in self._bag.topics if kind == _TRANSFORMS)
        static = [name for name in topics if name.endswith("_static")]
        with contextlib.suppress(*_UNREADABLE):
            frame = str(shown.header.frame_id).lstrip("/")
            for names in filter(None, (static, [name for name in topics if name not in static])):
                found = self._bag.of([_TRANSFORMS], *names)
                for _, _, message in islice(found, _MOST_TRANSFORMS):
                    for each in from_ros(TFMessage, message).transforms:
                        transforms.add_message(each, static=True)
                if (root := transforms.root(frame)) != frame:
                    T_root_camera = transforms.lookup(root, frame, 0.0)
                    if problem := optical_problem(T_root_camera, frame, root):
                        self.notes += (problem,)
                    else:
                        self.up_camera = T_root_camera[2, :3]
                    return


class _Poses:
    """The poses of cameras in odom, from transforms and odometry as they come.

    Odometry counts for a frame that transforms have not told yet.
    """

    def __init__(self) -> None:
        self._transforms = TransformBuffer()
        self._odom, self._told = "odom", set[str]()

    def add(self, message: Any, *, static: bool = False) -> None:
        """Take the transforms of a message."""
        with contextlib.suppress(*_UNREADABLE):
            for each in from_ros(TFMessage, message).transforms:
                self._told.add(each.child_frame_id.lstrip("/"))
                self._transforms.add_message(each, static=static)

    def add_odometry(self, message: Any) -> None:
        """Take the pose of the robot, whose frame is odom from then on."""
        with contextlib.suppress(*_UNREADABLE):
            odometry = from_ros(Odometry, message)
            child = odometry.child_frame_id.lstrip("/") or "base_link"
            self._odom = odometry.header.frame_id.lstrip("/") or self._odom
            if child not in self._told:
                pose = odometry.pose.pose
                T_odom_child = pose_matrix(pose.position, pose.orientation)
                stamp_s = to_seconds(odometry.header.stamp)
                self._transforms.add(self._odom, child, stamp_s, T_odom_child)

    def reach(self, header: Any) -> bool:
        """Return whether no later message can tell more about the pose at a time."""
        with contextlib.suppress(NavError):
            latest_s = self._transforms.latest_s(self._odom, str(header.frame_id))
            return latest_s >= to_seconds(header.stamp)
        return False

    def of(self, header: Any) -> FloatArray | None:
        """Return the pose (4, 4) of the optical frame of an image; None if it is not known."""
        frame = str(header.frame_id)
        with contextlib.suppress(NavError):
            T_odom_camera = self._transforms.lookup(self._odom, frame, to_seconds(header.stamp))
            return None if optical_problem(T_odom_camera, frame, self._odom) else T_odom_camera
        return None


def _is_zero(info: Any, names: str) -> bool:
    """Return whether a matrix is zero, as an uncalibrated driver sends it; in capitals in ROS 1."""
    return not any(np.any(getattr(info, name, 0.0)) for name in names)
