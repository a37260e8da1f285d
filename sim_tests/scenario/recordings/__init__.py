"""Scenarios from recordings: tables of people read, checked, resampled and written as YAML."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._convert import ConvertedRecording, RecordingOptions, scenario_from_recording
    from ._table import LONGEST_GAP_S, RecordedTable, RecordedTrack, read_table

__all__ = [
    "LONGEST_GAP_S",
    "ConvertedRecording",
    "RecordedTable",
    "RecordedTrack",
    "RecordingOptions",
    "read_table",
    "scenario_from_recording",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._convert": (
            "ConvertedRecording",
            "RecordingOptions",
            "scenario_from_recording",
        ),
        "._table": (
            "LONGEST_GAP_S",
            "RecordedTable",
            "RecordedTrack",
            "read_table",
        ),
    },
)
