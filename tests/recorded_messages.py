"""Messages written into a rosbag2 recording, as a robot's recorder would."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from nav_adapter.ros2 import encode
from nav_adapter.ros2.messages import Message, ros_type


def recorded(
    path: Path,
    found: Iterable[tuple[str, float, Message]],
    plugin: StoragePlugin = StoragePlugin.SQLITE3,
    compression: CompressionMode | None = None,
) -> Path:
    """Write topic, time of recording in seconds and message of each; return the folder."""
    store, connections = get_typestore(Stores.ROS2_HUMBLE), {}
    writer = Writer(path, version=9, storage_plugin=plugin)
    if compression is not None:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        for topic, at_s, message in found:
            assert isinstance(message, Message)
            if topic not in connections:
                kind = ros_type(type(message))
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], round(1e9 * at_s), encode(message))
    return path
