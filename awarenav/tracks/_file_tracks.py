"""The tracks, or the ids of people, that a file has already."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, get_args

import numpy as np

from perception.arrays import finite_array, finite_number
from tracking import TrackStatus

from ..errors import AwarenavError, counted
from ._history import HistoryBuilder, TrackedRecording, TrackSample, camera_pose
from ._recording import RecordedFrame, Recording, floor_covariance


def tracks_in_file(recording: Recording) -> TrackedRecording:
    """Return the tracks of a file's ``tracks``, else those of its people's ids.

    People without a tracker have only the α that a frame has measured, and no lower bound.

    Raises:
        AwarenavError: for a file without tracks and ids, or a track that is not valid.
    """
    frames = sorted(recording.frames, key=lambda frame: frame.stamp_s)
    tracked = any(frame.tracks is not None for frame in frames)
    has_ids = any(id is not None for frame in frames for id in frame.ids)
    if not tracked and not has_ids and any(frame.observations for frame in frames):
        raise AwarenavError(
            f"{recording.path} has no ids of people; leave out --ids to track them here"
        )
    builder = HistoryBuilder()
    without_id = 0
    for frame in frames:
        samples = (
            _samples_of_tracks(frame, str(recording.path)) if tracked else _samples_of_people(frame)
        )
        builder.add(frame.stamp_s, samples)
        without_id += sum(id is None for id in frame.ids)
    remarks = [f"{counted(without_id, 'observation')} without an id left out"] if without_id else []
    poses = [camera_pose(frame.T_odom_camera) for frame in frames if recording.has_camera]
    return TrackedRecording(
        builder.histories(),
        np.array([frame.stamp_s for frame in frames]),
        np.array(poses).reshape(-1, 3),
        tuple(remarks),
        "tracks of the file" if tracked else "ids of the file",
    )


def _samples_of_tracks(frame: RecordedFrame, path: str) -> Iterator[tuple[int, TrackSample]]:
    """Yield id and sample of each of the frame's ``tracks``."""
    measured = dict(zip(frame.ids, frame.observations, strict=True))
    for index, track in enumerate(frame.tracks or ()):
        where = f"{path}, frame {frame.name!r}, track {index}"
        id, status = track.get("id"), track.get("status")
        if isinstance(id, bool) or not isinstance(id, int):
            raise AwarenavError(f"{where}: id must be a whole number, got {id!r:.60}")
        if status not in get_args(TrackStatus):
            raise AwarenavError(
                f"{where}: status must be one of {', '.join(get_args(TrackStatus))}, "
                f"got {status!r:.60}"
            )
        observation = measured.get(id)
        yield (
            id,
            TrackSample(
                stamp_s=frame.stamp_s,
                status=str(status),
                is_frame=True,
                seen=_nonnegative(track, "time_since_seen_s", where) == 0.0,
                position_odom_m=finite_array(
                    f"{where}: position_odom_m", track.get("position_odom_m"), (2,), AwarenavError
                ),
                velocity_odom_mps=finite_array(
                    f"{where}: velocity_odom_mps",
                    track.get("velocity_odom_mps"),
                    (2,),
                    AwarenavError,
                ),
                position_covariance_m2=None,
                awareness=_nonnegative(track, "awareness", where, 1.0),
                awareness_std=_nonnegative(track, "awareness_std", where),
                awareness_lower=_nonnegative(track, "awareness_lower", where, 1.0),
                measured_awareness=None if observation is None else observation.awareness,
                measured_awareness_std=None if observation is None else observation.awareness_std,
            ),
        )


def _nonnegative(track: dict[str, Any], name: str, where: str, maximum: float = math.inf) -> float:
    return finite_number(
        f"{where}: {name}", track.get(name), AwarenavError, minimum=0.0, maximum=maximum
    )


def _samples_of_people(frame: RecordedFrame) -> Iterator[tuple[int, TrackSample]]:
    """Yield id and sample of each person with an id."""
    positions = frame.positions_odom_m()
    for id, observation, position in zip(frame.ids, frame.observations, positions, strict=True):
        if id is None:
            continue
        yield (
            id,
            TrackSample(
                stamp_s=frame.stamp_s,
                status="given",
                is_frame=True,
                seen=True,
                position_odom_m=position,
                velocity_odom_mps=None,
                position_covariance_m2=floor_covariance(
                    frame.T_odom_camera, observation.position_covariance_m2
                ),
                awareness=math.nan,
                awareness_std=math.nan,
                awareness_lower=math.nan,
                measured_awareness=observation.awareness,
                measured_awareness_std=observation.awareness_std,
            ),
        )
