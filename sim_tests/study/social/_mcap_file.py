"""Episodes as MCAP recordings with JSON messages, which Foxglove draws.

``/episode`` holds what a SocNav3 trajectory has beside its frames, once; ``/frame`` its frames.
``/robot`` and ``/people`` hold the same poses as ``foxglove.PoseInFrame`` and ``PosesInFrame``.
Recordings need the package mcap, of the extra ``ros2``.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

from awarenav.files import atomic_path

from ...world.errors import SimError
from ._episode import SocialEpisode
from ._schema import EPISODE_SCHEMA, FRAME_SCHEMA
from ._socnav3 import episode_from, frames_of, header_of, trajectory_problems

_EPISODE: Final = "/episode"
_FRAME: Final = "/frame"
_ROBOT: Final = "/robot"
_PEOPLE: Final = "/people"

_NUMBER: Final = {"type": "number"}
_INTEGER: Final = {"type": "integer"}
_TIME: Final = {"type": "object", "properties": {"sec": _INTEGER, "nsec": _INTEGER}}
_POSE: Final = {
    "type": "object",
    "properties": {
        "position": {"type": "object", "properties": dict.fromkeys("xyz", _NUMBER)},
        "orientation": {"type": "object", "properties": dict.fromkeys("xyzw", _NUMBER)},
    },
}
_STAMPED: Final = {"timestamp": _TIME, "frame_id": {"type": "string"}}
_POSE_IN_FRAME: Final = {"type": "object", "properties": {**_STAMPED, "pose": _POSE}}
_POSES_IN_FRAME: Final = {
    "type": "object",
    "properties": {**_STAMPED, "poses": {"type": "array", "items": _POSE}},
}
_TOPICS: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    _EPISODE: ("awarenav.Episode", dict(EPISODE_SCHEMA)),
    _FRAME: ("socnav3.Frame", dict(FRAME_SCHEMA)),
    _ROBOT: ("foxglove.PoseInFrame", _POSE_IN_FRAME),
    _PEOPLE: ("foxglove.PosesInFrame", _POSES_IN_FRAME),
}


def write_mcap(path: Path, episode: SocialEpisode) -> None:
    """Write an episode as an MCAP recording whose time begins at 0.

    Raises:
        NavError: the package mcap is missing.
        SimError: the file cannot be written, or the goal of the robot is not known.
    """
    from nav_adapter.ros2 import JsonMcapRecorder  # noqa: PLC0415 - an extra

    frames = list(frames_of(episode))
    start_s = frames[0]["timestamp"]
    with atomic_path(path, SimError) as part, JsonMcapRecorder(part) as recorder:
        for topic, (name, schema) in _TOPICS.items():
            recorder.add_topic(topic, name, schema)
        recorder.write(_EPISODE, header_of(episode), 0.0)
        for frame in frames:
            stamp_s = frame["timestamp"] - start_s
            stamped = {"timestamp": _time(stamp_s), "frame_id": "odom"}
            poses = [_pose(person) for person in frame["people"]]
            recorder.write(_FRAME, frame, stamp_s)
            recorder.write(_ROBOT, {**stamped, "pose": _pose(frame["robot"])}, stamp_s)
            recorder.write(_PEOPLE, {**stamped, "poses": poses}, stamp_s)


def check_mcap(path: Path) -> list[str]:
    """Return what is wrong with a recording, one sentence for each field; empty if nothing is.

    Raises:
        NavError: the file cannot be read, is no MCAP file, or the package mcap is missing.
    """
    return _document(path)[1]


def read_mcap(path: Path) -> SocialEpisode:
    """Return the episode of a recording.

    Raises:
        NavError: the file cannot be read, is no MCAP file, or the package mcap is missing.
        SimError: it does not hold an episode.
    """
    document, found = _document(path)
    if found:
        raise SimError(f"{path} is not a recorded episode: {found[0]}")
    return episode_from(document, document["sequence"], path.stem)


def _document(path: Path) -> tuple[dict[str, Any], list[str]]:
    """Return the trajectory in a recording, and what is wrong with it."""
    from nav_adapter.ros2 import read_json_messages  # noqa: PLC0415 - an extra

    headers: list[Any] = []
    frames: list[Any] = []
    for topic, value in read_json_messages(path):
        if topic == _EPISODE:
            headers.append(value)
        elif topic == _FRAME:
            frames.append(value)
    if len(headers) != 1 or not isinstance(headers[0], dict):
        return {}, [f"topic {_EPISODE} must hold one JSON object, got {len(headers)} messages"]
    document = {**headers[0], "sequence": frames}
    return document, trajectory_problems(document)


def _time(stamp_s: float) -> dict[str, int]:
    seconds, nanoseconds = divmod(round(stamp_s * 1e9), 1_000_000_000)
    return {"sec": seconds, "nsec": nanoseconds}


def _pose(body: dict[str, Any]) -> dict[str, Any]:
    half_rad = 0.5 * body["angle"]
    return {
        "position": {"x": body["x"], "y": body["y"], "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half_rad), "w": math.cos(half_rad)},
    }
