"""Messages of ROS 1 and ROS 2 recordings; no other module imports ``rosbags``."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

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


def read_messages(
    path: Path, reader: Any, connections: Sequence[Any]
) -> Iterator[tuple[str, float, Any]]:
    """Yield topic, time of recording (s) and message of some connections of an open recording.

    Raises:
        AwarenavError: for a message that cannot be read.
    """
    # The library takes none for all.
    messages = reader.messages(connections=connections) if connections else iter(())
    while True:
        try:
            connection, recorded_ns, raw = next(messages)
            message = reader.deserialize(raw, connection.msgtype)
        except StopIteration:
            return
        except Exception as cause:
            raise AwarenavError(f"{path}: the rest cannot be read: {_explained(cause)}") from cause
        yield topic_name(connection.topic), recorded_ns * 1e-9, message


class BagMessages:
    """Messages of some topics of a recording, in the order in which they were recorded.

    Args:
        path: of the recording, as in :func:`open_bag`.
        required: the topics, ``/scan`` or similar, and their types, ``sensor_msgs/msg/LaserScan``.
            A topic that was recorded without a leading slash is the same one.
        optional: topics that the recording may lack.

    Attributes:
        topics: name and type of everything that was recorded.

    Raises:
        AwarenavError: for a file that is not a recording, or that lacks a topic of this type.
    """

    def __init__(
        self, path: Path, required: Mapping[str, str], optional: Mapping[str, str]
    ) -> None:
        self._path, self._reader = path, open_bag(path)
        connections = self._reader.connections
        self.topics = {(topic_name(each.topic), str(each.msgtype)) for each in connections}
        for topic, kind in required.items():
            if (topic, kind) not in self.topics:
                self._reader.close()
                known = ", ".join(f"{name} ({type_})" for name, type_ in sorted(self.topics))
                raise AwarenavError(
                    f"{path} has no topic {topic} of type {kind}; it has {known or 'none'}"
                )
        wanted = {**optional, **required}
        self._connections = [
            each for each in connections if wanted.get(topic_name(each.topic)) == each.msgtype
        ]

    def __iter__(self) -> Iterator[tuple[str, float, Any]]:
        """Yield topic, time of recording (s) and message.

        Raises:
            AwarenavError: for a message that cannot be read.
        """
        return read_messages(self._path, self._reader, self._connections)

    def of(self, topic: str) -> Iterator[tuple[str, float, Any]]:
        """Yield the messages of one topic, as iterating over all does.

        Raises:
            AwarenavError: for a message that cannot be read.
        """
        own = [each for each in self._connections if topic_name(each.topic) == topic]
        return read_messages(self._path, self._reader, own)

    def of_kinds(self, kinds: Collection[str]) -> Iterator[tuple[str, float, Any]]:
        """Yield the messages of all topics of some types, whether they were asked for or not.

        Raises:
            AwarenavError: for a message that cannot be read.
        """
        found = [each for each in self._reader.connections if each.msgtype in kinds]
        return read_messages(self._path, self._reader, found)

    def close(self) -> None:
        """Close the recording."""
        self._reader.close()
