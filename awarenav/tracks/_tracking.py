"""The tracks of a recording: those of the tracker, or of the file itself; smoothed as well."""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, get_args

import numpy as np
from tqdm import tqdm

from perception import Camera
from perception.arrays import FloatArray, finite_array, finite_number
from tracking import (
    CameraView,
    PersonTrack,
    PersonTracker,
    TrackerConfig,
    TrackingError,
    TrackStatus,
)

from ..errors import AwarenavError, counted
from ..estimate import ids_of_tracks
from ._history import HistoryBuilder, TrackedRecording, TrackHistory, TrackSample
from ._recording import ASSUMED_POSITION_STD_M, RecordedFrame, Recording
from ._smoothing import SmoothedPath, smooth

# A recording may have pauses of any length, and nobody sets its clock.
_OF_RECORDINGS: Final = {"max_pause_s": 1e12, "new_clock_after_s": 1e5}
# Period of the predictions between frames that are further apart.
_PREDICTION_PERIOD_S: Final = 0.1
# Most predictions in one pause of the camera.
_MOST_PREDICTIONS: Final = 600


def track_recording(
    recording: Recording, config: TrackerConfig | None = None, camera: Camera | None = None
) -> TrackedRecording:
    """Run the tracker over the frames in the order of the file.

    A late frame that the tracker accepts changes its earlier tracks. The histories are therefore
    those of the accepted frames in the order of their stamps; the tracker ends with the same tracks
    either way.

    Args:
        recording: the frames.
        config: of the tracker; None for its defaults.
        camera: whose field of view the tracker uses; None if it is not known.

    Raises:
        AwarenavError: for a frame that the tracker cannot use; the message names it.
    """
    settings = TrackerConfig() if config is None else config

    def tracker() -> PersonTracker:
        return PersonTracker(
            settings.model_copy(update=_OF_RECORDINGS),
            view=None if camera is None else CameraView(camera),
        )

    accepted, late, refused, ahead = _accepted_frames(recording, tracker)
    working = tracker()
    builder = HistoryBuilder()
    for frame in tqdm(accepted, "tracks", unit="frame", file=sys.stderr, disable=None):
        latest_s = frame.stamp_s if working.last_stamp_s is None else working.last_stamp_s
        for stamp_s in _prediction_stamps(latest_s, frame.stamp_s):
            tracks = working.predict(stamp_s)
            builder.add(stamp_s, ((each.id, _sample(each, stamp_s)) for each in tracks))
        tracks = _update(working, frame, recording)
        builder.add(frame.stamp_s, _samples_of_frame(frame, tracks))
    remarks = tuple(_remarks(recording, late, refused, ahead))
    return _tracked(builder, accepted, recording, remarks, "tracks")


def _tracked(
    builder: HistoryBuilder,
    frames: Sequence[RecordedFrame],
    recording: Recording,
    remarks: tuple[str, ...],
    source: str,
) -> TrackedRecording:
    """Return the tracks with the path of the camera."""
    poses = [_camera_pose(frame.T_odom_camera) for frame in frames if recording.has_camera]
    return TrackedRecording(
        builder.histories(),
        np.array([frame.stamp_s for frame in frames]),
        np.array(poses).reshape(-1, 3),
        remarks,
        source,
    )


def _camera_pose(T_odom_camera: FloatArray) -> tuple[float, float, float]:
    """Return position and view of a camera on the floor plane: x, y (m), heading (rad)."""
    x, y = T_odom_camera[:2, 3].tolist()
    ahead = T_odom_camera[:2, 2]
    return x, y, float(np.arctan2(ahead[1], ahead[0]))


def _accepted_frames(
    recording: Recording, tracker: Callable[[], PersonTracker]
) -> tuple[list[RecordedFrame], int, int, int]:
    """Return the frames that a tracker accepts, by stamp, and the numbers of others.

    These are frames put back in time, refused as late, and taken back since they were far ahead.
    Only a tracker that gets the frames in the order of the file can tell.
    """
    frames = list(recording.frames)
    if all(earlier.stamp_s <= later.stamp_s for earlier, later in itertools.pairwise(frames)):
        return frames, 0, 0, 0
    trial = tracker()
    accepted: list[RecordedFrame] = []
    late = 0
    for frame in frames:
        last_s = trial.last_stamp_s
        is_late = last_s is not None and frame.stamp_s < last_s
        refused_before = trial.refused_late_frames
        try:
            _update(trial, frame, recording)
        except AwarenavError:
            if trial.refused_late_frames == refused_before:
                raise
            continue
        if last_s is not None and trial.last_stamp_s is not None and trial.last_stamp_s < last_s:
            # The frame shows that the one before was wrong.
            accepted = [one for one in accepted if one.stamp_s < last_s]
            is_late = False
        accepted.append(frame)
        late += is_late
    accepted.sort(key=lambda frame: frame.stamp_s)
    return accepted, late, trial.refused_late_frames, trial.refused_early_frames


def _update(
    tracker: PersonTracker, frame: RecordedFrame, recording: Recording
) -> tuple[PersonTrack, ...]:
    try:
        return tracker.update(frame.observations, frame.stamp_s, frame.T_odom_camera)
    except TrackingError as error:
        raise AwarenavError(f"{recording.path}, frame {frame.name!r}: {error}") from error


def _prediction_stamps(start_s: float, end_s: float) -> Iterator[float]:
    """Yield the stamps of predictions between two frames; none if the frames are close together."""
    number = min(int((end_s - start_s) / _PREDICTION_PERIOD_S), _MOST_PREDICTIONS)
    for index in range(1, number):
        yield start_s + (end_s - start_s) * index / number


def _samples_of_frame(
    frame: RecordedFrame, tracks: Sequence[PersonTrack]
) -> Iterator[tuple[int, TrackSample]]:
    """Yield id and sample of each track at a frame, with the α that the frame has measured."""
    ids = ids_of_tracks(frame.observations, tracks, frame.T_odom_camera)
    observed = dict(zip(ids, frame.observations, strict=True))
    for track in tracks:
        sample = _sample(track, frame.stamp_s, seen=track.time_since_seen_s == 0.0)
        sample.is_frame = True
        if track.id in observed:
            sample.measured_awareness = observed[track.id].awareness
            sample.measured_awareness_std = observed[track.id].awareness_std
        yield track.id, sample


def _sample(track: PersonTrack, stamp_s: float, *, seen: bool = False) -> TrackSample:
    """Return the sample of a track between frames."""
    # The tracker calls the prediction of a person in the latest frame confirmed.
    coasting = not seen and track.status == "confirmed"
    return TrackSample(
        stamp_s=stamp_s,
        status="coasting" if coasting else track.status,
        is_frame=False,
        seen=seen,
        position_odom_m=track.position_odom_m,
        velocity_odom_mps=track.velocity_odom_mps,
        position_covariance_m2=track.covariance_odom[:2, :2],
        awareness=track.awareness,
        awareness_std=track.awareness_std,
        awareness_lower=track.awareness_lower,
        covariance_odom=track.covariance_odom,
    )


def _remarks(recording: Recording, late: int, refused: int, ahead: int) -> Iterator[str]:
    if recording.without_covariance:
        yield (
            f"{counted(recording.without_covariance, 'observation')} without "
            f"{'position_covariance_m2' if recording.has_camera else 'std_m'}: "
            f"a standard deviation of {ASSUMED_POSITION_STD_M:g} m is "
            "assumed"
        )
    if late:
        yield f"{counted(late, 'late frame')} put back in time by the tracker"
    if ahead:
        yield f"{counted(ahead, 'frame')} far ahead of those that follow: not used"
    if refused:
        yield f"{counted(refused, 'late frame')} refused by the tracker and not used"


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
        builder.add(
            frame.stamp_s,
            _samples_of_tracks(frame, recording) if tracked else _samples_of_people(frame),
        )
        without_id += sum(id is None for id in frame.ids)
    remarks = [f"{counted(without_id, 'observation')} without an id left out"] if without_id else []
    source = "tracks of the file" if tracked else "ids of the file"
    return _tracked(builder, frames, recording, tuple(remarks), source)


def _samples_of_tracks(
    frame: RecordedFrame, recording: Recording
) -> Iterator[tuple[int, TrackSample]]:
    """Yield id and sample of each of the frame's ``tracks``."""
    observed = dict(zip(frame.ids, frame.observations, strict=True))
    for index, track in enumerate(frame.tracks or ()):
        where = f"{recording.path}, frame {frame.name!r}, track {index}"
        id, status = track.get("id"), track.get("status")
        if isinstance(id, bool) or not isinstance(id, int):
            raise AwarenavError(f"{where}: id must be a whole number, got {id!r:.60}")
        if status not in get_args(TrackStatus):
            raise AwarenavError(
                f"{where}: status must be one of {', '.join(get_args(TrackStatus))}, "
                f"got {status!r:.60}"
            )
        place, velocity = (
            finite_array(f"{where}: {name}", track.get(name), (2,), AwarenavError)
            for name in ("position_odom_m", "velocity_odom_mps")
        )
        observation = observed.get(id)
        yield (
            id,
            TrackSample(
                stamp_s=frame.stamp_s,
                status=str(status),
                is_frame=True,
                seen=_nonnegative(track, "time_since_seen_s", where) == 0.0,
                position_odom_m=place,
                velocity_odom_mps=velocity,
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
    turn, positions = frame.T_odom_camera[:2, :3], frame.positions_odom_m()
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
                position_covariance_m2=turn @ observation.position_covariance_m2 @ turn.T,
                awareness=math.nan,
                awareness_std=math.nan,
                awareness_lower=math.nan,
                measured_awareness=observation.awareness,
                measured_awareness_std=observation.awareness_std,
            ),
        )


def smoothed_path(history: TrackHistory, config: TrackerConfig | None) -> SmoothedPath | None:
    """Return a track smoothed up to the last frame that shows the person.

    None for a track whose covariance is not known, or that only one frame shows.
    """
    last = max((row for row, each in enumerate(history.samples) if each.seen), default=-1)
    samples = history.samples[: last + 1]
    if len(samples) < 2 or any(each.covariance_odom is None for each in samples):
        return None
    return smooth(*arrays_of(samples), config)


def arrays_of(samples: Sequence[TrackSample]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stamps (N,), states (N, 4) and covariances (N, 4, 4) of samples of a tracker."""
    states = [
        [*each.position_odom_m, *(() if each.velocity_odom_mps is None else each.velocity_odom_mps)]
        for each in samples
    ]
    return (
        np.array([each.stamp_s for each in samples]),
        np.array(states).reshape(-1, 4),
        np.array([each.covariance_odom for each in samples]).reshape(-1, 4, 4),
    )


def distances_m(history: TrackHistory, path: SmoothedPath) -> FloatArray:
    """Return the distances (N,) between a track and its smoothed path at its frames."""
    count = len(path.stamps_s)
    offset = history.positions_odom_m[:count] - path.states[:, :2]
    return np.asarray(np.hypot(offset[:, 0], offset[:, 1]))
