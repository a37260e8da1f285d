"""A file of estimates, truth or positions as frames for the tracker."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from perception import PersonObservation
from perception.arrays import FloatArray, finite_number, rigid_transform

from ..errors import AwarenavError, counted
from ..estimate import fixed_camera_pose
from ..records import PersonRecord, Record, read_people, read_records
from ._people_table import PersonRow, read_people_table

#: Standard deviation per axis that is assumed for a position without a covariance.
ASSUMED_POSITION_STD_M: Final = 0.05
_STD: Final = "std_m"
_WHOLE: Final = re.compile(r"-?[0-9]+")
_MOST_NAMED: Final = 20
# Observations need a sensor's frame: this one looks straight down from above the people. Its x is
# odom's x, its y is against odom's y.
_ABOVE_M: Final = 8.0
_CHEST_M: Final = 1.2
_T_ODOM_ABOVE: Final = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, _ABOVE_M],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFrame:
    """A frame whose camera pose is known or assumed.

    Attributes:
        name: of the frame.
        stamp_s: time of the image.
        T_odom_camera: (4, 4).
        observations: of the people that have a position.
        ids: of each observation, the id in the file; None if it has none.
        tracks: the tracks that ``awarenav estimate --tracks`` has written; None if there are none.
    """

    name: str
    stamp_s: float
    T_odom_camera: FloatArray
    observations: tuple[PersonObservation, ...]
    ids: tuple[int | None, ...]
    tracks: tuple[dict[str, Any], ...] | None

    def positions_odom_m(self) -> list[FloatArray]:
        """Return the position of each observation on the floor plane, (2,) each."""
        T = self.T_odom_camera
        return [T[:2, :3] @ each.position_camera_m + T[:2, 3] for each in self.observations]


@dataclass(frozen=True, slots=True)
class Recording:
    """The frames of a file.

    Attributes:
        path: of the file.
        frames: in the order of the lines.
        remarks: sentences about everything that was left out or assumed.
        without_covariance: number of observations with the assumed position covariance.
        has_camera: whether the poses of the frames are those of a camera; not so for positions.
    """

    path: Path
    frames: tuple[RecordedFrame, ...]
    remarks: tuple[str, ...]
    without_covariance: int
    has_camera: bool = True


def read_recording(path: Path) -> Recording:
    """Read a JSON Lines file of frames.

    An incomplete last line, a frame without a camera pose in a file whose other frames have one,
    and a person without a position are left out, each with a remark. If no frame has a pose, the
    camera is assumed to be fixed.

    Raises:
        AwarenavError: for a file that cannot be read, and for a line or value that is not valid.
    """
    records = read_records(path)
    counts: Counter[str] = Counter(incomplete=_count_lines(path) - len(records))
    fixed = all(record["T_odom_camera"] is None for record in records)
    frames = []
    for record in records:
        if record.get("no_view") is not None:
            counts["no view"] += 1
            continue
        if record["T_odom_camera"] is None and not fixed:
            counts["no pose"] += 1
            continue
        frames.append(_frame(record, f"{path}, frame {record['frame']!r}", counts))
    if fixed and frames:
        counts["fixed camera"] = len(frames)
    return Recording(path, tuple(frames), tuple(_remarks(counts)), counts["no covariance"])


def _count_lines(path: Path) -> int:
    """Return the number of lines that are not blank."""
    with path.open(encoding="utf-8") as file:
        return sum(1 for line in file if line.strip())


def _frame(record: Record, where: str, counts: Counter[str]) -> RecordedFrame:
    """Return a record as a frame; ``counts`` counts what is left out."""
    stamp_s = finite_number(f"{where}: stamp_s", record["stamp_s"], AwarenavError)
    pose = record["T_odom_camera"]
    T = (
        fixed_camera_pose()
        if pose is None
        else rigid_transform(f"{where}: T_odom_camera", pose, AwarenavError)
    )
    observations, ids = [], []
    for index, person in enumerate(read_people(record, where)):
        observation = _observation(person, stamp_s, counts)
        if observation is not None:
            observations.append(observation)
            ids.append(_id(record["people"][index].get("id"), f"{where}, person {index}"))
    return RecordedFrame(
        name=str(record["frame"]),
        stamp_s=stamp_s,
        T_odom_camera=T,
        observations=tuple(observations),
        ids=tuple(ids),
        tracks=_track_records(record.get("tracks"), where),
    )


def _observation(
    person: PersonRecord, stamp_s: float, counts: Counter[str]
) -> PersonObservation | None:
    """Return the observation of a person; None without a position."""
    if person.position_camera_m is None:
        counts["no position"] += 1
        return None
    covariance = person.position_covariance_m2
    if covariance is None:
        counts["no covariance"] += 1
        covariance = ASSUMED_POSITION_STD_M**2 * np.eye(3)
    lasting = person.range_lasting_relative_std
    if person.position_covariance_m2 is None:
        lasting = 0.0  # it is a part of the covariance
    awareness, std = person.awareness, person.awareness_std
    if awareness is not None and std is None:
        counts["no std"] += 1
        awareness = None  # its accuracy is not known, so it is no evidence
    return PersonObservation(
        stamp_s=stamp_s,
        position_camera_m=person.position_camera_m,
        position_covariance_m2=covariance,
        gaze_camera=person.gaze_camera,
        awareness=awareness,
        awareness_std=None if awareness is None else std,
        score=person.score,
        box_xyxy_px=person.box_xyxy_px,
        awareness_reason=person.awareness_reason,
        range_lasting_relative_std=lasting,
        size_range_m=person.size_range_m,
        size_range_relative_std=person.size_range_relative_std,
        eyes_seen=person.eyes_seen,
    )


def _id(value: Any, where: str) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int):
        raise AwarenavError(f"{where}: id must be a whole number or null, got {value!r:.60}")
    return value


def _track_records(value: Any, where: str) -> tuple[dict[str, Any], ...] | None:
    if value is None:
        return None
    if not isinstance(value, list) or not all(isinstance(track, dict) for track in value):
        raise AwarenavError(f"{where}: tracks must be a list of mappings, got {value!r:.60}")
    return tuple(value)


def _remarks(counts: Counter[str]) -> list[str]:
    """Return a sentence for each kind of thing that was left out or assumed."""
    sentences = {
        "incomplete": "the last line is incomplete and is left out",
        "fixed camera": "no frame has a T_odom_camera: the camera is assumed to be fixed, and odom "
        "is on the floor under it",
        "no view": "{} left out whose picture shows nothing (no_view)",
        "no pose": "{} without T_odom_camera left out, since other frames have one",
        "no position": "{} without position_camera_m left out",
        "no std": "{} with an awareness but no awareness_std: it counts as no evidence",
    }
    nouns = {"no pose": "frame", "no view": "frame"}
    return [
        sentence.format(counted(counts[key], nouns.get(key, "observation")))
        for key, sentence in sentences.items()
        if counts[key] > 0
    ]


def is_positions(path: Path) -> bool:
    """Return whether a file holds positions, by its suffix."""
    return path.suffix.lower() in (".csv", ".tsv")


def read_positions(path: Path) -> Recording:
    """Read a CSV of positions on the floor, in metres of any fixed frame.

    Rows of the same time are one frame. Ids that are no whole numbers are numbered.

    Raises:
        AwarenavError: for a file that cannot be read, without the columns, with a value that is not
            valid, or in other units; see :func:`read_people_table`.
    """
    rows = sorted(read_people_table(path, (_STD,)).rows, key=attrgetter("t_s"))
    for row in rows:
        std_m = row.more.get(_STD)
        if std_m is not None and std_m <= 0.0:
            raise AwarenavError(f"{path}, line {row.line}: {_STD} must be above 0 m, got {std_m:g}")
    ids, remark = _numbers_of([row.id for row in rows])
    frames = [
        _frame_of_rows(stamp_s, list(group), ids)
        for stamp_s, group in itertools.groupby(rows, attrgetter("t_s"))
    ]
    assumed = sum(row.more.get(_STD) is None for row in rows)
    return Recording(path, tuple(frames), remark, assumed, has_camera=False)


def _numbers_of(ids: list[str]) -> tuple[dict[str, int], tuple[str, ...]]:
    """Return the number of each id, and a remark if some are no whole numbers."""
    numbers = {id: int(id) for id in ids if _WHOLE.fullmatch(id)}
    first = max(numbers.values(), default=0) + 1
    others = [id for id in dict.fromkeys(ids) if id not in numbers]
    texts = {id: first + index for index, id in enumerate(others)}
    if not texts:
        return numbers, ()
    named = ", ".join(f"{number} is {id!r}" for id, number in list(texts.items())[:_MOST_NAMED])
    more = ", …" if len(texts) > _MOST_NAMED else ""
    return {**numbers, **texts}, (f"ids that are no whole numbers are numbered: {named}{more}",)


def _frame_of_rows(stamp_s: float, rows: list[PersonRow], ids: dict[str, int]) -> RecordedFrame:
    observations = tuple(
        PersonObservation(
            stamp_s=stamp_s,
            position_camera_m=np.array([row.x_m, -row.y_m, _ABOVE_M - _CHEST_M]),
            position_covariance_m2=(row.more.get(_STD) or ASSUMED_POSITION_STD_M) ** 2 * np.eye(3),
            gaze_camera=None,
            awareness=None,
            awareness_std=None,
            score=1.0,
        )
        for row in rows
    )
    return RecordedFrame(
        name=f"{stamp_s:g} s",
        stamp_s=stamp_s,
        T_odom_camera=_T_ODOM_ABOVE,
        observations=observations,
        ids=tuple(ids[row.id] for row in rows),
        tracks=None,
    )
