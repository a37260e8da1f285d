"""Messages of ROS 1 and ROS 2 recordings; no other module imports ``rosbags``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from perception.documents import read_yaml
from perception.installation import install_command

from ..errors import AwarenavError, MissingExtraError

try:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise MissingExtraError(
        "reading recordings needs the package rosbags, which is not installed; it is the extra "
        f"'rosbag': {install_command('rosbag')}"
    ) from cause


def open_bag(path: Path) -> Any:
    """Return an open ``rosbags`` reader of a recording.

    Args:
        path: rosbag2 folder, ``.db3``, ``.mcap``, or a ROS 1 ``.bag``.

    Raises:
        AwarenavError: for a file that is not a recording.
    """
    if (metadata := path / "metadata.yaml").is_file():
        read_yaml(metadata, AwarenavError)  # refuses what would harm the library
    try:
        reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
    # The library also raises errors of its storage layers.
    except Exception as cause:
        raise AwarenavError(f"cannot read the recording {path}: {cause}") from cause
    return reader


class BagMessages:
    """Messages of some topics of a recording, in the order in which they were recorded.

    Args:
        path: of the recording, as in :func:`open_bag`.
        required: the topics, ``/scan`` or similar, and their types, ``sensor_msgs/msg/LaserScan``.
        optional: topics that the recording may lack.

    Raises:
        AwarenavError: for a file that is not a recording, or that lacks a topic of this type.
    """

    def __init__(
        self, path: Path, required: Mapping[str, str], optional: Mapping[str, str]
    ) -> None:
        self._path, self._reader = path, open_bag(path)
        kinds = {each.topic: each.msgtype for each in self._reader.connections}
        for topic, kind in required.items():
            if kinds.get(topic) != kind:
                self._reader.close()
                known = ", ".join(f"{name} ({type_})" for name, type_ in sorted(kinds.items()))
                raise AwarenavError(
                    f"{path} has no topic {topic} of type {kind}; it has {known or 'none'}"
                )
        wanted = {**optional, **required}
        self._connections = [
            each for each in self._reader.connections if wanted.get(each.topic) == each.msgtype
        ]

    def __iter__(self) -> Iterator[tuple[str, float, Any]]:
        """Yield topic, time of recording (s) and message.

        Raises:
            AwarenavError: for a message that cannot be read.
        """
        messages = self._reader.messages(connections=self._connections)
        while True:
            try:
                connection, recorded_ns, raw = next(messages)
                message = self._reader.deserialize(raw, connection.msgtype)
            except StopIteration:
                return
            except Exception as cause:
                raise AwarenavError(f"{self._path}: the rest cannot be read: {cause}") from cause
            yield connection.topic, recorded_ns * 1e-9, message

    def close(self) -> None:
        """Close the recording."""
        self._reader.close()
