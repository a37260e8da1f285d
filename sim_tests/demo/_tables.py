"""The tables ``episodes.csv`` (one row per episode) and ``encounter.csv`` (two per frame)."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final

from awarenav.files import csv_number

from ..crossing import CrossingFrame, CrossingResult

EPISODE_COLUMNS: Final = (
    "scenario",
    "seed",
    "policy",
    "planner",
    "perception",
    "success",
    "contact",
    "contact_by",
    "min_separation_m",
    "time_to_goal_s",
    "max_speed_within_2m_mps",
    "min_margin_m",
    "violation_time_s",
    "contacts",
    "duration_s",
)
ENCOUNTER_COLUMNS: Final = ("t_s", "perception", "awareness", "d_fwd_m", "d_lat_m")


def episode_row(result: CrossingResult) -> list[str]:
    """Return the row of ``episodes.csv`` of a crossing, in the order of :data:`EPISODE_COLUMNS`."""
    return [
        result.scenario,
        str(result.seed),
        result.policy,
        result.planner,
        result.perception,
        str(result.success).lower(),
        str(result.contact).lower(),
        result.contact_by,
        csv_number(result.min_separation_m),
        csv_number(result.time_to_goal_s),
        csv_number(result.max_speed_within_2m_mps),
        csv_number(result.min_margin_m),
        csv_number(result.violation_time_s),
        str(len(result.contacts)),
        csv_number(result.duration_s),
    ]


class EpisodeTable(AbstractContextManager["EpisodeTable"]):
    """A writer of ``episodes.csv``; after an interrupted run the file holds whole rows.

    Args:
        path: the file; an existing one is replaced.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow(EPISODE_COLUMNS)
        self._file.flush()

    def close(self) -> None:
        """Close the file; all rows are already written."""
        self._file.close()

    def __exit__(self, *exception: object) -> None:
        self.close()

    def add(self, result: CrossingResult) -> None:
        """Append one crossing."""
        self._writer.writerow(episode_row(result))
        self._file.flush()


def encounter_rows(frame: CrossingFrame, perception: str = "keypoints") -> list[list[str]]:
    """Return the rows of ``encounter.csv`` of one frame: truth, then perception.

    A frame without an observation, or without evidence of awareness, has empty cells.
    """
    true = frame.truth[0]
    observation = frame.observation_of(0)
    position = None if observation is None else observation.position_camera_m
    return [
        [
            csv_number(frame.t_s),
            "truth",
            csv_number(true.awareness),
            csv_number(true.d_fwd_m),
            csv_number(true.d_lat_m),
        ],
        [
            csv_number(frame.t_s),
            perception,
            csv_number(None if observation is None else observation.awareness),
            csv_number(None if position is None else float(position[2])),
            csv_number(None if position is None else -float(position[0])),
        ],
    ]


def write_encounter(
    path: Path, frames: Iterable[CrossingFrame], perception: str = "keypoints"
) -> None:
    """Write ``encounter.csv``, two rows per frame; the file appears whole or not at all."""
    partial = path.with_name(path.name + ".part")
    with partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(ENCOUNTER_COLUMNS)
        for frame in frames:
            writer.writerows(encounter_rows(frame, perception))
    partial.replace(path)
