"""Estimates as JSON Lines, in the format of rendered truth."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception import PersonKeypoints, PersonObservation
from perception.arrays import FloatArray
from perception.layouts import COCO_NAMES, FOOT_NAMES, LEFT_SHOULDER, RIGHT_SHOULDER
from tracking import PersonTrack

from ..errors import AwarenavError
from ..files import check_output, require_writable
from ..records import Record, RecordFile, continue_records, read_records, write_records
from ._estimator import FrameEstimate

# Significant digits of a number; any error of an estimate is far larger.
_DIGITS: Final = 7


def estimate_record(estimate: FrameEstimate, settings: str) -> Record:
    """Return the record of a frame's estimate.

    ``id`` is that of the track with ``--tracks``, else null: without a tracker, nobody is
    identified from frame to frame. ``T_odom_camera`` is null if no pose was known or assumed.

    Args:
        estimate: of the frame.
        settings: hash of the settings; see :func:`settings_hash`.
    """
    record: Record = {
        "frame": estimate.frame.name,
        "stamp_s": round(estimate.frame.stamp_s, 9),
        "T_odom_camera": None
        if estimate.T_odom_camera is None
        else _rounded_list(estimate.T_odom_camera),
        "people": [
            _person_record(observation, track_id)
            for observation, track_id in zip(estimate.observations, estimate.track_ids, strict=True)
        ],
        "settings": settings,
    }
    if estimate.unfit:
        record["simulator_networks"] = list(estimate.unfit)
    if estimate.no_view is not None:
        record["no_view"] = estimate.no_view
    if estimate.tracks is not None:
        record["tracks"] = [track_record(track) for track in estimate.tracks]
    return record


def _person_record(observation: PersonObservation, track_id: int | None) -> dict[str, Any]:
    box, gaze = observation.box_xyxy_px, observation.gaze_camera
    keypoints = observation.keypoints
    record = {
        "id": track_id,
        "box_xyxy_px": None if box is None else _rounded_list(box),
        "position_camera_m": _rounded_list(observation.position_camera_m),
        "position_covariance_m2": _rounded_list(observation.position_covariance_m2),
        "gaze_camera": None if gaze is None else _rounded_list(gaze),
        "awareness": _rounded(observation.awareness),
        "awareness_std": _rounded(observation.awareness_std),
        "awareness_reason": observation.awareness_reason,
        "score": _rounded(observation.score),
        "keypoints": {} if keypoints is None else _keypoint_records(keypoints),
    }
    if observation.eyes_seen:
        record["eyes_seen"] = True
    if observation.range_lasting_relative_std > 0.0:
        record["range_lasting_relative_std"] = _rounded(observation.range_lasting_relative_std)
    if observation.size_range_m is not None:
        record["size_range_m"] = _rounded(observation.size_range_m)
        record["size_range_relative_std"] = _rounded(observation.size_range_relative_std)
    return record


def _keypoint_records(person: PersonKeypoints) -> dict[str, list[float]]:
    """Return u, v and score of body, feet and neck by name.

    The neck is the midpoint of the shoulders; its score is the lower of theirs.
    """
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


def track_record(track: PersonTrack) -> dict[str, Any]:
    """Return an entry of a record's ``tracks``."""
    return {
        "id": track.id,
        "status": track.status,
        "position_odom_m": _rounded_list(track.position_odom_m),
        "velocity_odom_mps": _rounded_list(track.velocity_odom_mps),
        "awareness": _rounded(track.awareness),
        "awareness_std": _rounded(track.awareness_std),
        "awareness_lower": _rounded(track.awareness_lower),
        "time_since_seen_s": _rounded(track.time_since_seen_s),
    }


def _rounded_list(array: FloatArray) -> Any:
    """Return a vector as a list, or a matrix as a list of rows, of rounded numbers."""
    flat = [_rounded(value) for value in array.ravel().tolist()]
    if array.ndim == 1:
        return flat
    return [flat[start : start + array.shape[1]] for start in range(0, len(flat), array.shape[1])]


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{_DIGITS}g}")


def settings_hash(settings: Mapping[str, object]) -> str:
    """Return eight hexadecimal digits that differ for different settings."""
    text = repr(sorted((name, str(value)) for name, value in settings.items()))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


def check_results(path: Path, *, resume: bool = False, overwrite: bool = False) -> None:
    """Refuse what :func:`open_results` refuses, but for other settings, before any work."""
    check_output(path, (".jsonl",))
    if path.exists() and not resume and not overwrite:
        raise AwarenavError(
            f"{path} exists already: --resume continues it, --overwrite replaces it"
        )
    require_writable(path.parent)


def open_results(
    path: Path, settings: str, *, resume: bool = False, overwrite: bool = False
) -> tuple[RecordFile, frozenset[str]]:
    """Return a file that gets one line per frame, and the names of the frames that it has already.

    Args:
        path: of the file.
        settings: hash of the settings, which every line has.
        resume: continues a file that was made with the same settings.
        overwrite: replaces an existing file.

    Raises:
        AwarenavError: for another suffix, and for an existing file that may not be replaced or
            cannot be continued.
    """
    check_results(path, resume=resume, overwrite=overwrite)
    if not (path.exists() and resume):
        write_records(path, ())
        return RecordFile(path), frozenset()
    others = {str(record.get("settings")) for record in read_records(path)} - {settings}
    if others:
        raise AwarenavError(
            f"{path} was made with other settings (hash {', '.join(sorted(others))}, now "
            f"{settings}); use the same settings to continue it, --overwrite, or another file"
        )
    done = frozenset(str(record["frame"]) for record in continue_records(path))
    return RecordFile(path), done
