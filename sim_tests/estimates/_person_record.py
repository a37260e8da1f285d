"""A person of a frame's record, read and checked for judging."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from perception.arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    unit_vector,
)

from .._errors import SimError
from ..sets._frame_records import Record


@dataclass(frozen=True, slots=True, eq=False)
class JudgedPerson:
    """One person of a record; what the record does not say is None.

    Attributes:
        box_xyxy_px: (4,).
        position_camera_m: (3,) the body's centre line at chest height.
        position_covariance_m2: (3, 3).
        gaze_camera: (3,) unit vector.
        head_forward_camera: (3,) unit vector: the head's forward axis where ``gaze_camera`` holds
            the eyes' direction (rendered truth).
        awareness: α in [0, 1].
        awareness_std: ≥ 0.
        score: in [0, 1].
        occlusion: share of the person that something else hides; 0 where the record is silent.
        truncation: share of the person outside the picture; 0 where the record is silent.
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
        """Angle between the head's forward axis and the way to the camera: 0 faces it."""
        forward = self.gaze_camera if self.head_forward_camera is None else self.head_forward_camera
        if forward is None or self.position_camera_m is None or not self.range_m:
            return None
        cosine = -float(forward @ self.position_camera_m) / self.range_m
        return math.acos(min(max(cosine, -1.0), 1.0))


def judged_person(person: Any, where: str) -> JudgedPerson:
    """Read one entry of ``people``; raises SimError naming ``where`` for values that are none."""
    if not isinstance(person, dict):
        raise SimError(f"{where}: a person must be a mapping, got {person!r:.60}")

    def array(name: str, shape: tuple[int, ...]) -> FloatArray | None:
        value = person.get(name)
        return None if value is None else finite_array(f"{where}: {name}", value, shape, SimError)

    def unit(name: str) -> FloatArray | None:
        value = person.get(name)
        return None if value is None else unit_vector(f"{where}: {name}", value, SimError)

    def share(name: str, default: float | None) -> float | None:
        value = person.get(name)
        if value is None:
            return default
        return finite_number(f"{where}: {name}", value, SimError, minimum=0.0, maximum=1.0)

    covariance = person.get("position_covariance_m2")
    std = person.get("awareness_std")
    return JudgedPerson(
        box_xyxy_px=array("box_xyxy_px", (4,)),
        position_camera_m=array("position_camera_m", (3,)),
        position_covariance_m2=None
        if covariance is None
        else covariance_matrix(f"{where}: position_covariance_m2", covariance, 3, SimError),
        gaze_camera=unit("gaze_camera"),
        head_forward_camera=unit("head_forward_camera"),
        awareness=share("awareness", None),
        awareness_std=None
        if std is None
        else finite_number(f"{where}: awareness_std", std, SimError, minimum=0.0),
        score=share("score", 1.0) or 0.0,
        occlusion=share("occlusion", 0.0) or 0.0,
        truncation=share("truncation", 0.0) or 0.0,
    )


def people_by_frame(records: list[Record], path: Any) -> dict[str, list[JudgedPerson]]:
    """The people of every frame by its name; raises SimError for a frame that comes twice."""
    frames: dict[str, list[JudgedPerson]] = {}
    for record in records:
        name = str(record["frame"])
        if name in frames:
            raise SimError(f"{path}: frame {name!r} comes twice")
        people = record["people"]
        if not isinstance(people, list):
            raise SimError(f"{path}, frame {name!r}: people must be a list, got {people!r:.60}")
        frames[name] = [
            judged_person(person, f"{path}, frame {name!r}, person {index}")
            for index, person in enumerate(people)
        ]
    return frames
