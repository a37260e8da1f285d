"""Runs the tracker over a recording and keeps its tracks at every frame."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from tqdm import tqdm

from perception import Camera
from tracking import CameraView, PersonTrack, PersonTracker, TrackerConfig, TrackingError

from ..errors import AwarenavError, counted
from ..estimate import ids_of_tracks
from ._history import HistoryBuilder, TrackedRecording, TrackSample, camera_pose
from ._recording import ASSUMED_POSITION_STD_M, RecordedFrame, Recording

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
            builder.add(stamp_s, _samples(tracks, stamp_s, is_frame=False))
        tracks = _update(working, frame, recording)
        measured = _measured_awareness(frame, tracks)
        builder.add(
            frame.stamp_s, _samples(tracks, frame.stamp_s, is_frame=True, measured=measured)
        )
    shown = accepted if recording.has_camera else []
    poses = np.array([camera_pose(frame.T_odom_camera) for frame in shown])
    return TrackedRecording(
        builder.histories(),
        np.array([frame.stamp_s for frame in accepted]),
        poses.reshape(-1, 3),
        tuple(_remarks(recording, late, refused, ahead)),
        "tracks",
    )


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


def _measured_awareness(
    frame: RecordedFrame, tracks: Sequence[PersonTrack]
) -> dict[int, tuple[float, float]]:
    """Return α and its standard deviation of a frame's observations, by the id of their track."""
    ids = ids_of_tracks(frame.observations, tracks, frame.T_odom_camera)
    return {
        id: (observation.awareness, observation.awareness_std)
        for id, observation in zip(ids, frame.observations, strict=True)
        if id is not None
        and observation.awareness is not None
        and observation.awareness_std is not None
    }


def _samples(
    tracks: Sequence[PersonTrack],
    stamp_s: float,
    *,
    is_frame: bool,
    measured: dict[int, tuple[float, float]] | None = None,
) -> list[tuple[int, TrackSample]]:
    measured = {} if measured is None else measured
    return [
        (track.id, _sample(track, stamp_s, is_frame, measured.get(track.id))) for track in tracks
    ]


def _sample(
    track: PersonTrack, stamp_s: float, is_frame: bool, measured: tuple[float, float] | None
) -> TrackSample:
    """Return the sample of a track."""
    seen = is_frame and track.time_since_seen_s == 0.0
    # The tracker calls the prediction of a person in the latest frame confirmed.
    coasting = not seen and track.status == "confirmed"
    return TrackSample(
        stamp_s=stamp_s,
        status="coasting" if coasting else track.status,
        is_frame=is_frame,
        seen=seen,
        position_odom_m=track.position_odom_m,
        velocity_odom_mps=track.velocity_odom_mps,
        position_covariance_m2=track.covariance_odom[:2, :2],
        awareness=track.awareness,
        awareness_std=track.awareness_std,
        awareness_lower=track.awareness_lower,
        measured_awareness=None if measured is None else measured[0],
        measured_awareness_std=None if measured is None else measured[1],
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
