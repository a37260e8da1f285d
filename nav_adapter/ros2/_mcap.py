"""MCAP recordings for Foxglove and ROS 2 tools; only this module imports ``mcap``."""

from __future__ import annotations

from pathlib import Path

import yaml

from perception.installation import install_command

from .._errors import NavError
from ._message import definition, ros_type
from ._topics import Topic

try:
    from mcap.writer import Writer
except ImportError as cause:  # pragma: no cover - depends on the installation
    raise NavError(
        "recording needs the package mcap, which is not installed; it is part of the extra "
        f"'ros2': {install_command('ros2')}"
    ) from cause


class McapRecorder:
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
        try:
            self._stream = Path(path).open("wb")  # noqa: SIM115 - closed with the index
        except OSError as cause:
            raise NavError(f"cannot write {path}: {cause.strerror or cause}") from cause
        self._writer = Writer(self._stream)
        self._writer.start(profile="ros2", library="awarenav")
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}

    def close(self) -> None:
        """Write the index and close the file."""
        if not self._stream.closed:
            self._writer.finish()
            self._stream.close()

    def __enter__(self) -> McapRecorder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

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
