"""The real tracker over a recording, with a note of everything that it said."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from tqdm import tqdm

from perception import Camera
from tracking import CameraView, PersonTrack, PersonTracker, TrackerConfig, TrackingError

from ..errors import AwarenavError
from ..estimate import ids_of_tracks
from ._history import HistoryBook, TrackRun, TrackSample, camera_pose
from ._recording import ASSUMED_POSITION_STD_M, RecordedFrame, Recording, count

# Between frames further apart than this, the tracker's prediction is drawn as often.
_PREDICTED_EVERY_S: Final = 0.1
# A longer pause is drawn with so many predictions and no more.
_MOST_PREDICTIONS: Final = 600


def follow(
    recording: Recording, config: TrackerConfig | None = None, camera: Camera | None = None
) -> TrackRun:
    """Give every frame to the tracker, in the order of the file, and keep what it answers.

    Late frames that the tracker takes change what it said before. Histories are then those of the
    frames that it took in the order of their stamps, which the tracker makes of them too.

    Args:
        recording: the frames.
        config: of the tracker; None for its defaults.
        camera: gives the tracker its view; None when nobody knows where the camera can see.

    Raises:
        AwarenavError: for a frame that the tracker cannot use, naming it.
    """

    def tracker() -> PersonTracker:
        return PersonTracker(config, view=None if camera is None else CameraView(camera))

    taken, late, refused = _taken(recording, tracker)
    working = tracker()
    book = HistoryBook()
    for frame in tqdm(taken, "tracks", unit="frame", file=sys.stderr, disable=None):
        latest_s = frame.stamp_s if working.last_stamp_s is None else working.last_stamp_s
        for stamp_s in _between(latest_s, frame.stamp_s):
            tracks = working.predict(stamp_s)
            book.note(stamp_s, _samples(tracks, stamp_s, is_frame=False))
        tracks = _update(working, frame, recording)
        measured = _measured(frame, tracks)
        book.note(frame.stamp_s, _samples(tracks, frame.stamp_s, is_frame=True, measured=measured))
    return TrackRun(
        book.histories(),
        np.array([frame.stamp_s for frame in taken]),
        np.array([camera_pose(frame.T_odom_camera) for frame in taken]).reshape(-1, 3),
        tuple(_remarks(recording, late, refused)),
        "tracks",
    )


def _taken(
    recording: Recording, tracker: Callable[[], PersonTracker]
) -> tuple[list[RecordedFrame], int, int]:
    """The frames that a tracker takes, by stamp; how many of them were late; how many it refused.

    Only a tracker that gets them in the order of the file can tell.
    """
    frames = list(recording.frames)
    if all(earlier.stamp_s <= later.stamp_s for earlier, later in itertools.pairwise(frames)):
        return frames, 0, 0
    asked = tracker()
    taken, late = [], 0
    for frame in frames:
        is_late = asked.last_stamp_s is not None and frame.stamp_s < asked.last_stamp_s
        refused_before = asked.refused_late_frames
        try:
            _update(asked, frame, recording)
        except AwarenavError:
            if asked.refused_late_frames == refused_before:
                raise
            continue
        taken.append(frame)
        late += is_late
    taken.sort(key=lambda frame: frame.stamp_s)
    return taken, late, asked.refused_late_frames


def _update(
    tracker: PersonTracker, frame: RecordedFrame, recording: Recording
) -> tuple[PersonTrack, ...]:
    try:
        return tracker.update(frame.observations, frame.stamp_s, frame.T_odom_camera)
    except TrackingError as error:
        raise AwarenavError(f"{recording.path}, frame {frame.name!r}: {error}") from error


def _between(start_s: float, end_s: float) -> Iterator[float]:
    """Instants inside a gap at which to ask for a prediction; none inside a short one."""
    number = min(int((end_s - start_s) / _PREDICTED_EVERY_S), _MOST_PREDICTIONS)
    for index in range(1, number):
        yield start_s + (end_s - start_s) * index / number


def _measured(
    frame: RecordedFrame, tracks: Sequence[PersonTrack]
) -> dict[int, tuple[float, float]]:
    """α of this frame's observations and its standard deviation by the id of their track."""
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
    seen = is_frame and track.time_since_seen_s == 0.0
    # A prediction of somebody whom the latest frame showed is still called confirmed.
    coasts = not seen and track.status == "confirmed"
    return TrackSample(
        stamp_s=stamp_s,
        status="coasting" if coasts else track.status,
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
    )


def _remarks(recording: Recording, late: int, refused: int) -> Iterator[str]:
    if recording.without_covariance:
        yield (
            f"{count(recording.without_covariance, 'observation')} without position_covariance_m2: "
            f"a standard deviation of {ASSUMED_POSITION_STD_M:g} m is taken"
        )
    if late:
        yield f"{count(late, 'late frame')} put back in time by the tracker"
    if refused:
        yield f"{count(refused, 'late frame')} refused by the tracker and not used"
