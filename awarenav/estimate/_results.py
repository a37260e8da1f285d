"""Estimates in the schema of rendered truth.

The growing JSON Lines file of estimates.
"""

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

from ..closing import Closing
from ..errors import AwarenavError
from ..records import Record, read_records, record_line, write_records
from ._estimator import FrameEstimate

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


def settings_mark(settings: Mapping[str, object]) -> str:
    """Eight hexadecimal digits that differ for different settings."""
    text = repr(sorted((name, str(value)) for name, value in settings.items()))
    return hashlib.sha256(text.encode()).hexdigest()[:8]


class ResultsFile(Closing):
    """Appends a line a frame, on the disk as soon as it is whole.

    Args:
        path: of the file.
        mark: of the settings, which every line carries.
        resume: continues a file made with the same settings; its frames are in ``done``.
        overwrite: replaces a file that is there.

    Raises:
        AwarenavError: for a file that is there and may not be replaced or cannot be continued.
    """

    def __init__(
        self, path: Path, mark: str, *, resume: bool = False, overwrite: bool = False
    ) -> None:
        self.done: frozenset[str] = frozenset()
        exists = path.exists()
        if path.is_dir():
            raise AwarenavError(f"--out must be a file, {path} is a folder")
        if exists and not resume and not overwrite:
            raise AwarenavError(
                f"{path} exists already: --resume continues it, --overwrite replaces it"
            )
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if exists and resume:
                records = read_records(path)
                _same_settings(path, records, mark)
                write_records(path, records)  # without a line that was cut off
                self.done = frozenset(str(record["frame"]) for record in records)
            self._file = path.open("a" if resume else "w", encoding="utf-8")
        except OSError as cause:
            raise AwarenavError(f"cannot write {path}: {cause.strerror or cause}") from cause

    def add(self, record: Record) -> None:
        """Append one frame."""
        self._file.write(record_line(record))
        self._file.flush()

    def close(self) -> None:
        """Close the file; what was added is in it already."""
        self._file.close()


def _same_settings(path: Path, records: list[Record], mark: str) -> None:
    others = {str(record.get("settings")) for record in records} - {mark}
    if others:
        raise AwarenavError(
            f"{path} was made with other settings (mark {', '.join(sorted(others))}, these have "
            f"{mark}); use the same ones to continue it, --overwrite, or another file"
        )
