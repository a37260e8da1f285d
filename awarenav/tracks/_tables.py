"""Tracks as a table to read and as a table to compute with."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..errors import AwarenavError
from ..files import csv_number
from ._history import TrackHistory, TrackSample
from ._truth import Matched, who

#: Columns of the CSV file: one row a track and frame, empty where nothing is known.
CSV_COLUMNS: Final = (
    "stamp_s",
    "id",
    "status",
    "seen",
    "x_odom_m",
    "y_odom_m",
    "vx_odom_mps",
    "vy_odom_mps",
    "x_std_m",
    "y_std_m",
    "awareness",
    "awareness_std",
    "awareness_lower",
    "measured_awareness",
    "measured_awareness_std",
)
_DASH: Final = "–"


def summary_lines(
    histories: Sequence[TrackHistory],
    matches: dict[int, Matched] | None = None,
) -> list[str]:
    """A line a track, with a header: when it lived, how often it was seen, how aware it was."""
    header = ["id", "born (s)", "confirmed (s)", "died (s)", "seen", "coasted", "mean α", "lower"]
    if matches is not None:
        header.append("person")
    rows = [header]
    for history in histories:
        row = [
            str(history.id),
            _seconds(history.born_s),
            _seconds(history.confirmed_s),
            _seconds(history.died_s),
            str(history.seen_frames),
            str(len(history.frames) - history.seen_frames),
            _share(_mean_awareness(history)),
            _share(history.mean("awareness_lower")),
        ]
        if matches is not None:
            row.append(who(matches.get(history.id, [])))
        rows.append(row)
    widths = [max(len(row[column]) for row in rows) for column in range(len(header))]
    return [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        for row in rows
    ]


def summary_records(
    histories: Sequence[TrackHistory], matches: dict[int, Matched] | None = None
) -> list[dict[str, Any]]:
    """The summary as plain data, a mapping for each track; None where nothing is known."""
    records = []
    for history in histories:
        mean, lower = _mean_awareness(history), history.mean("awareness_lower")
        record: dict[str, Any] = {
            "id": history.id,
            "born_s": history.born_s,
            "confirmed_s": history.confirmed_s,
            "died_s": history.died_s,
            "seen_frames": history.seen_frames,
            "coasted_frames": len(history.frames) - history.seen_frames,
            "mean_awareness": mean if math.isfinite(mean) else None,
            "mean_awareness_lower": lower if math.isfinite(lower) else None,
        }
        if matches is not None:
            record["person"] = who(matches.get(history.id, []))
        records.append(record)
    return records


def write_csv(path: Path, histories: Sequence[TrackHistory]) -> None:
    """Write a row a track and frame, by stamp and id; the file appears whole or not at all.

    Raises:
        AwarenavError: for a place that cannot be written.
    """
    samples = [(each.stamp_s, history.id, each) for history in histories for each in history.frames]
    samples.sort(key=lambda row: row[:2])
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(CSV_COLUMNS)
            writer.writerows(_row(id, sample) for _, id, sample in samples)
        part.replace(path)
    except OSError as cause:
        raise AwarenavError(f"cannot write {path}: {cause.strerror or cause}") from cause
    finally:
        part.unlink(missing_ok=True)


def _row(id: int, sample: TrackSample) -> list[object]:
    velocity, covariance = sample.velocity_odom_mps, sample.position_covariance_m2
    numbers = (
        *sample.position_odom_m.tolist(),
        *((None, None) if velocity is None else velocity.tolist()),
        *((None, None) if covariance is None else np.sqrt(np.diagonal(covariance)).tolist()),
        sample.awareness,
        sample.awareness_std,
        sample.awareness_lower,
        sample.measured_awareness,
        sample.measured_awareness_std,
    )
    # All digits of the stamp, so that rows can be joined with the frames of the file.
    return [
        repr(sample.stamp_s),
        id,
        sample.status,
        str(sample.seen).lower(),
        *map(csv_number, numbers),
    ]


def _mean_awareness(history: TrackHistory) -> float:
    """Of the filter, or of the measurements where there is none."""
    mean = history.mean("awareness")
    return mean if math.isfinite(mean) else history.mean("measured_awareness")


def _seconds(value: float | None) -> str:
    return _DASH if value is None else f"{value:.2f}"


def _share(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else _DASH
