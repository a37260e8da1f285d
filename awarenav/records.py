"""Frames and the people in them as JSON Lines: one format for truth and for estimates.

``{"frame", "stamp_s", "T_odom_camera", "people": [{"id", "box_xyxy_px", "position_camera_m",
"gaze_camera", "awareness", "awareness_std", "score", "keypoints": {name: [u, v, score]}}]}``; a
frame or a person may have more keys. Boxes count pixels from the image's corner, maxima exclusive;
keypoints are in the coordinates of :meth:`perception.Camera.project`: the centre of a pixel is a
whole number.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from perception.arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    unit_vector,
)
from perception.documents import parse_json, read_lines
from perception.evidence import AWARENESS_REASONS, AwarenessReason

from .errors import AwarenavError, not_one_of
from .files import atomic_path

Record = dict[str, Any]

_KEYS: Final = ("frame", "stamp_s", "T_odom_camera", "people")


def record_line(record: Record) -> str:
    """Return a frame as one line of a JSON Lines file.

    Raises:
        AwarenavError: for a number that is not finite, which JSON does not have.
    """
    try:
        return json.dumps(record, separators=(", ", ": "), allow_nan=False) + "\n"
    except ValueError as cause:
        raise AwarenavError(
            f"frame {record.get('frame')!r} has a number that is not finite"
        ) from cause


def read_records(path: Path) -> list[Record]:
    """Read a JSON Lines file of frames; an incomplete last line is left out.

    Raises:
        AwarenavError: for a file that cannot be read; for a line that is not a frame, with its
            number.
    """
    records = []
    for number, line in enumerate(read_lines(path, AwarenavError), start=1):
        if not line.strip():
            continue
        where = f"{path}, line {number}"
        try:
            record = parse_json(line, where, AwarenavError)
        except AwarenavError:
            if not line.endswith(b"\n"):  # the writer was interrupted
                break
            raise
        if not isinstance(record, dict) or any(key not in record for key in _KEYS):
            raise AwarenavError(f"{where}: a frame needs the keys {', '.join(_KEYS)}")
        records.append(record)
    return records


def continue_records(path: Path) -> list[Record]:
    """Return the frames of a file that is to be continued, and leave only their lines in it.

    An unfinished last line, which an interrupted writer leaves, is cut off with a remark on
    standard error.

    Raises:
        AwarenavError: for a file that cannot be read or written; for any other line that is not a
            frame, with its number; for two frames of one name.
    """
    records = read_records(path)
    by_name = {str(record["frame"]): record for record in records}
    if len(by_name) < len(records):
        names = [str(record["frame"]) for record in records]
        twice = next(name for name in names if names.count(name) > 1)
        raise AwarenavError(f"{path}: two frames have the name {twice!r}")
    if sum(1 for line in read_lines(path, AwarenavError) if line.strip()) > len(records):
        print(f"{path}: the last line is unfinished, its frame is made again", file=sys.stderr)
    write_records(path, records)
    return records


class RecordFile(AbstractContextManager["RecordFile"]):
    """A JSON Lines file that frames are appended to; a killed process leaves half a line at most.

    Args:
        path: of the file, made when missing.
        error: class of the errors.

    Raises:
        AwarenavError: or ``error``, if the file cannot be opened.
    """

    def __init__(self, path: Path, error: type[AwarenavError] = AwarenavError) -> None:
        self._path, self._error = path, error
        try:
            self._file = path.open("ab", buffering=0)
        except OSError as cause:
            raise error(f"cannot write {path}: {cause.strerror or cause}") from cause

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; every line is already in it."""
        self._file.close()

    def add(self, record: Record) -> None:
        """Append a frame.

        Raises:
            AwarenavError: or the class given, if it cannot be written, as on a full disk.
        """
        rest = memoryview(record_line(record).encode())
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as cause:
            raise self._error(
                f"cannot write {self._path}: {cause.strerror or cause}; the lines so far are "
                "kept, and --resume continues"
            ) from cause


def write_records(path: Path, records: Iterable[Record]) -> None:
    """Write a JSON Lines file of frames as :func:`~awarenav.files.atomic_path` does.

    Raises:
        AwarenavError: for a place that cannot be written, or a number that is not finite.
    """
    with atomic_path(path) as part, part.open("w", encoding="utf-8") as file:
        file.writelines(record_line(record) for record in records)
        file.flush()
        os.fsync(file.fileno())


@dataclass(frozen=True, slots=True, eq=False)
class PersonRecord:
    """A person in a frame's record; None for what the record does not have.

    Attributes:
        box_xyxy_px: (4,).
        position_camera_m: (3,) the body's centre line at chest height.
        position_covariance_m2: (3, 3).
        gaze_camera: (3,) unit vector.
        head_forward_camera: (3,) unit vector, the head's forward axis; rendered truth has it, since
            its ``gaze_camera`` is the direction of the eyes.
        awareness: α in [0, 1].
        awareness_std: ≥ 0.
        score: in [0, 1].
        occlusion: share of the person that other things hide; 0 if the record has none.
        truncation: share of the person outside the image; 0 if the record has none.
        awareness_reason: why there is no ``awareness``, as in
            :class:`~perception.PersonObservation`, like all that follow.
        range_lasting_relative_std: ≥ 0; 0 if the record has none.
        size_range_m: > 0.
        size_range_relative_std: ≥ 0; None if and only if ``size_range_m`` is None.
        eyes_seen: False if the record does not say so.
    """

    box_xyxy_px: FloatArray | None
    position_camera_m: FloatArray | None
    position_covariance_m2: FloatArray | None
    gaze_camera: FloatArray | None
    head_forward_camera: FloatArray | None
    awareness: float | None
    awareness_std: float | None
    score: float
    occlusion: float
    truncation: float
    awareness_reason: AwarenessReason | None
    range_lasting_relative_std: float
    size_range_m: float | None
    size_range_relative_std: float | None
    eyes_seen: bool

    @property
    def height_px(self) -> float:
        """Height of the box; infinite without one, so that no limit leaves the person out."""
        box = self.box_xyxy_px
        return math.inf if box is None else float(box[3] - box[1])

    @property
    def range_m(self) -> float | None:
        """Distance from the camera."""
        position = self.position_camera_m
        return None if position is None else float(np.linalg.norm(position))

    @property
    def facing_rad(self) -> float | None:
        """Angle between the head's forward axis and the direction to the camera; 0 faces it."""
        forward = self.gaze_camera if self.head_forward_camera is None else self.head_forward_camera
        if forward is None or self.position_camera_m is None or not self.range_m:
            return None
        cosine = -float(forward @ self.position_camera_m) / self.range_m
        return math.acos(min(max(cosine, -1.0), 1.0))


def read_person(person: Any, where: str) -> PersonRecord:
    """Read an entry of ``people``.

    Raises:
        AwarenavError: for a value that is not valid; the message begins with ``where``.
    """
    if not isinstance(person, dict):
        raise AwarenavError(f"{where}: a person must be a mapping, got {person!r:.60}")

    def array(name: str, shape: tuple[int, ...]) -> FloatArray | None:
        value = person.get(name)
        return (
            None if value is None else finite_array(f"{where}: {name}", value, shape, AwarenavError)
        )

    def unit(name: str) -> FloatArray | None:
        value = person.get(name)
        return None if value is None else unit_vector(f"{where}: {name}", value, AwarenavError)

    def share(name: str, default: float | None) -> float | None:
        value = person.get(name)
        if value is None:
            return default
        return finite_number(f"{where}: {name}", value, AwarenavError, minimum=0.0, maximum=1.0)

    def number(name: str, *, positive: bool = False) -> float | None:
        value = person.get(name)
        if value is None:
            return None
        return finite_number(
            f"{where}: {name}", value, AwarenavError, minimum=0.0, exclusive_minimum=positive
        )

    covariance = person.get("position_covariance_m2")
    size_range_m = number("size_range_m", positive=True)
    size_std = number("size_range_relative_std")
    if (size_range_m is None) != (size_std is None):
        raise AwarenavError(
            f"{where}: size_range_m and size_range_relative_std must both be given or both be "
            f"left out, got {size_range_m} and {size_std}"
        )
    return PersonRecord(
        box_xyxy_px=array("box_xyxy_px", (4,)),
        position_camera_m=array("position_camera_m", (3,)),
        position_covariance_m2=None
        if covariance is None
        else covariance_matrix(f"{where}: position_covariance_m2", covariance, 3, AwarenavError),
        gaze_camera=unit("gaze_camera"),
        head_forward_camera=unit("head_forward_camera"),
        awareness=share("awareness", None),
        awareness_std=number("awareness_std"),
        score=share("score", 1.0) or 0.0,
        occlusion=share("occlusion", 0.0) or 0.0,
        truncation=share("truncation", 0.0) or 0.0,
        awareness_reason=_reason(person, where),
        range_lasting_relative_std=number("range_lasting_relative_std") or 0.0,
        size_range_m=size_range_m,
        size_range_relative_std=size_std,
        eyes_seen=_flag(person, "eyes_seen", where),
    )


def _reason(person: Record, where: str) -> AwarenessReason | None:
    reason = person.get("awareness_reason")
    if reason is None:
        return None
    if reason not in AWARENESS_REASONS:
        raise AwarenavError(f"{where}: {not_one_of('awareness_reason', reason, AWARENESS_REASONS)}")
    if person.get("awareness") is not None:
        raise AwarenavError(
            f"{where}: awareness_reason must be null with an awareness, got {reason!r}"
        )
    return cast(AwarenessReason, reason)


def _flag(person: Record, name: str, where: str) -> bool:
    value = person.get(name)
    if value is not None and not isinstance(value, bool):
        raise AwarenavError(f"{where}: {name} must be true or false, got {value!r:.60}")
    return bool(value)


def people_by_frame(records: list[Record], path: Any) -> dict[str, list[PersonRecord]]:
    """Return the people of every frame, by the frame's name.

    Raises:
        AwarenavError: for two frames of one name, or a person that is not valid.
    """
    frames: dict[str, list[PersonRecord]] = {}
    for record in records:
        name = str(record["frame"])
        if name in frames:
            raise AwarenavError(f"{path}: two frames have the name {name!r}")
        frames[name] = read_people(record, f"{path}, frame {name!r}")
    return frames


def read_people(record: Record, where: str) -> list[PersonRecord]:
    """Return the people of a frame.

    Raises:
        AwarenavError: for a value that is not valid; the message begins with ``where``.
    """
    people = record["people"]
    if not isinstance(people, list):
        raise AwarenavError(f"{where}: people must be a list, got {people!r:.60}")
    return [read_person(each, f"{where}, person {index}") for index, each in enumerate(people)]
