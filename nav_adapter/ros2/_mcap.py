"""MCAP recordings for Foxglove and ROS 2 tools; only this module imports ``mcap``."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml

from perception.documents import parse_json
from perception.installation import install_command

from .._errors import NavError
from ._message import definition, ros_type
from ._topics import Topic

try:
    from mcap.exceptions import McapError
    from mcap.reader import make_reader
    from mcap.writer import Writer
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise NavError(
        "recording needs the package mcap, which is not installed; it is part of the extra "
        f"'ros2': {install_command('ros2')}"
    ) from cause


_FileT = TypeVar("_FileT", bound="_McapFile")


class _McapFile:
    """An MCAP file that is being written; its index is written when it is closed.

    Args:
        path: of the file; an existing file is replaced.
        profile: of the messages, as in the MCAP specification.

    Raises:
        NavError: if the file cannot be written.
    """

    def __init__(self, path: str | Path, profile: str) -> None:
        self._path = Path(path)
        try:
            self._stream = self._path.open("wb")
        except OSError as cause:
            raise NavError(f"cannot write {self._path}: {cause.strerror or cause}") from cause
        self._writer = Writer(self._stream)
        self._writer.start(profile=profile, library="awarenav")
        self._channels: dict[str, int] = {}

    def close(self) -> None:
        """Write the index and close the file."""
        if not self._stream.closed:
            self._writer.finish()
            self._stream.close()

    def __enter__(self: _FileT) -> _FileT:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class McapRecorder(_McapFile):
    """Writes CDR messages with their ROS 2 schemas to an MCAP file.

    The profile is "ros2", schemas are "ros2msg" and messages "cdr", which Foxglove,
    ``ros2 bag play``, ``mcap`` and ``rosbags`` read. Use it as a context manager: the index is
    written when the file is closed.

    Args:
        path: of the file; an existing file is replaced.

    Raises:
        NavError: if the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, "ros2")
        self._schemas: dict[str, int] = {}

    def write(self, topic: Topic, cdr: bytes, stamp_s: float) -> None:
        """Append one message, logged at ``stamp_s``."""
        if topic.name not in self._channels:
            self._channels[topic.name] = self._writer.register_channel(
                f"/{topic.name}", "cdr", self._schema(topic), _metadata(topic)
            )
        stamp_ns = round(stamp_s * 1e9)
        self._writer.add_message(self._channels[topic.name], stamp_ns, cdr, stamp_ns)

    def _schema(self, topic: Topic) -> int:
        name = ros_type(topic.message)
        if name not in self._schemas:
            text = definition(topic.message).encode()
            self._schemas[name] = self._writer.register_schema(name, "ros2msg", text)
        return self._schemas[name]


class JsonMcapRecorder(_McapFile):
    """Writes JSON messages with their JSON Schemas to an MCAP file, which Foxglove reads.

    Use it as a context manager: the index is written when the file is closed.

    Args:
        path: of the file; an existing file is replaced.

    Raises:
        NavError: if the file cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, "")

    def add_topic(self, topic: str, schema_name: str, schema: Mapping[str, Any]) -> None:
        """Open a topic whose messages follow a JSON Schema."""
        data = json.dumps(schema).encode()
        number = self._writer.register_schema(schema_name, "jsonschema", data)
        self._channels[topic] = self._writer.register_channel(topic, "json", number)

    def write(self, topic: str, message: Mapping[str, Any], stamp_s: float) -> None:
        """Append one message of a topic that is open, logged at ``stamp_s`` ≥ 0."""
        stamp_ns = round(stamp_s * 1e9)
        data = json.dumps(message, ensure_ascii=False).encode()
        self._writer.add_message(self._channels[topic], stamp_ns, data, stamp_ns)


def read_json_messages(path: str | Path) -> Iterator[tuple[str, Any]]:
    """Yield topic and value of the JSON messages of an MCAP file, in the order of their times.

    Messages in other encodings are left out.

    Raises:
        NavError: the file cannot be read, is no MCAP file, or has a message that is not JSON.
    """
    try:
        with Path(path).open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                if channel.message_encoding == "json":
                    source = f"{path}, topic {channel.topic}"
                    yield channel.topic, parse_json(message.data, source, NavError)
    except OSError as cause:
        raise NavError(f"cannot read {path}: {cause.strerror or cause}") from cause
    except McapError as cause:
        raise NavError(f"{path} is not an MCAP file: {cause}") from cause


def _metadata(topic: Topic) -> dict[str, str]:
    """Return the publisher's quality of service, in the form that rosbag2 writes and replays.

    The numbers are those of rmw (``rmw/types.h``); the times are its infinite duration.
    """
    infinite = {"sec": 9223372036, "nsec": 854775807}
    qos = {
        "history": 1,  # keep last
        "depth": topic.depth,
        "reliability": 1 if topic.reliable else 2,
        "durability": 1 if topic.transient_local else 2,
        "deadline": infinite,
        "lifespan": dict(infinite),
        "liveliness": 1,
        "liveliness_lease_duration": dict(infinite),
        "avoid_ros_namespace_conventions": False,
    }
    return {"offered_qos_profiles": yaml.safe_dump([qos], sort_keys=False)}
