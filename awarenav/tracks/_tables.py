"""Tracks as a table of text, as JSON, and as a CSV file."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from ..files import csv_number, write_text
from ._history import TrackHistory, TrackSample
from ._truth import TruthMatch, person_ids_text

#: Columns of the CSV file: one row per track and frame; empty for what is not known.
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
    matches: dict[int, list[TruthMatch]] | None = None,
) -> list[str]:
    """Return a table with one line per track: its life, its frames and its awareness."""
    header = ["id", "born (s)", "confirmed (s)", "died (s)", "seen", "coasted", "mean α", "lower"]
    if matches is not None:
        header.append("person")
    rows = [header]
    for history in histories:
        row = [
            str(history.id),
            _seconds_text(history.born_s),
            _seconds_text(history.confirmed_s),
            _seconds_text(history.died_s),
            str(history.seen_frames),
            str(len(history.frames) - history.seen_frames),
            _share_text(_mean_awareness(history)),
            _share_text(history.mean("awareness_lower")),
        ]
        if matches is not None:
            row.append(person_ids_text(matches.get(history.id, [])))
        rows.append(row)
    widths = [max(len(row[column]) for row in rows) for column in range(len(header))]
    return [
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        for row in rows
    ]


def summary_records(
    histories: Sequence[TrackHistory], matches: dict[int, list[TruthMatch]] | None = None
) -> list[dict[str, Any]]:
    """Return the table as plain data, one mapping per track; None for what is not known."""
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
            record["person"] = person_ids_text(matches.get(history.id, []))
        records.append(record)
    return records


def write_csv(path: Path, histories: Sequence[TrackHistory]) -> None:
    """Write a CSV file with one row per track and frame, in the order of stamps and ids.

    Raises:
        AwarenavError: for a place that cannot be written.
    """
    samples = [(each.stamp_s, history.id, each) for history in histories for each in history.frames]
    samples.sort(key=lambda row: row[:2])
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    writer.writerows(_csv_row(id, sample) for _, id, sample in samples)
    write_text(path, text.getvalue())


def _csv_row(id: int, sample: TrackSample) -> list[object]:
    """Return the row of a sample, in the order of :data:`CSV_COLUMNS`."""
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
    # The stamp has all its digits, so that rows can be joined with the frames of the file.
    return [
        repr(sample.stamp_s),
        id,
        sample.status,
        str(sample.seen).lower(),
        *map(csv_number, numbers),
    ]


def _mean_awareness(history: TrackHistory) -> float:
    """Return the mean α of the filter; without a filter, that of the measurements."""
    mean = history.mean("awareness")
    return mean if math.isfinite(mean) else history.mean("measured_awareness")


def _seconds_text(value: float | None) -> str:
    return _DASH if value is None else f"{value:.2f}"


def _share_text(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else _DASH
