"""Estimates in the schema of rendered truth."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from perception import PersonKeypoints, PersonObservation
from perception.arrays import FloatArray
from perception.layouts import COCO_NAMES, FOOT_NAMES, LEFT_SHOULDER, RIGHT_SHOULDER
from tracking import PersonTrack

from ..sets._frame_records import Record
from ._frame_estimate import FrameEstimate

# Digits that a number keeps; far below any error there is.
_DIGITS: Final = 7


def estimate_record(estimate: FrameEstimate, settings: str) -> Record:
    """One line of the results.

    ``id`` is the track's with ``--tracks`` and else null: without a tracker nothing says who is who
    from one frame to the next. ``T_odom_camera`` is null where no pose was known or assumed.

    Args:
        estimate: of the frame.
        settings: a mark of the settings it was made with.
    """
    record: Record = {
        "frame": estimate.frame.name,
        "stamp_s": round(estimate.frame.stamp_s, 9),
        "T_odom_camera": None
        if estimate.T_odom_camera is None
        else _numbers(estimate.T_odom_camera),
        "people": [
            _person(observation, keypoints, track_id)
            for observation, keypoints, track_id in zip(
                estimate.observations, estimate.keypoints, estimate.track_ids, strict=True
            )
        ],
        "settings": settings,
    }
    if estimate.tracks is not None:
        record["tracks"] = [_track(track) for track in estimate.tracks]
    return record


def _person(
    observation: PersonObservation, keypoints: PersonKeypoints | None, track_id: int | None
) -> dict[str, Any]:
    box, gaze = observation.box_xyxy_px, observation.gaze_camera
    return {
        "id": track_id,
        "box_xyxy_px": None if box is None else _numbers(box),
        "position_camera_m": _numbers(observation.position_camera_m),
        "position_covariance_m2": _numbers(observation.position_covariance_m2),
        "gaze_camera": None if gaze is None else _numbers(gaze),
        "awareness": _number(observation.awareness),
        "awareness_std": _number(observation.awareness_std),
        "score": _number(observation.score),
        "keypoints": {} if keypoints is None else _keypoints(keypoints),
    }


def _keypoints(person: PersonKeypoints) -> dict[str, list[float]]:
    """Body and feet by name, and the neck: the midpoint of the shoulders, as sure as the worse."""
    names = [*COCO_NAMES, *FOOT_NAMES][: len(person.scores)]
    shoulders = [LEFT_SHOULDER, RIGHT_SHOULDER]
    points = np.vstack(
        [person.keypoints_px[: len(names)], person.keypoints_px[shoulders].mean(axis=0)]
    )
    scores = [*person.scores[: len(names)].tolist(), float(person.scores[shoulders].min())]
    return {
        name: [round(u, 2), round(v, 2), round(score, 4)]
        for name, (u, v), score in zip([*names, "neck"], points.tolist(), scores, strict=True)
    }


def _track(track: PersonTrack) -> dict[str, Any]:
    return {
        "id": track.id,
        "status": track.status,
        "position_odom_m": _numbers(track.position_odom_m),
        "velocity_odom_mps": _numbers(track.velocity_odom_mps),
        "awareness": _number(track.awareness),
        "awareness_std": _number(track.awareness_std),
        "awareness_lower": _number(track.awareness_lower),
        "time_since_seen_s": _number(track.time_since_seen_s),
    }


def _numbers(array: FloatArray) -> Any:
    flat = [_number(value) for value in array.ravel().tolist()]
    if array.ndim == 1:
        return flat
    return [flat[start : start + array.shape[1]] for start in range(0, len(flat), array.shape[1])]


def _number(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{_DIGITS}g}")
