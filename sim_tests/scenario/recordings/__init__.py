"""Scenarios from recordings: tables of people read, checked, resampled and written as YAML."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

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

__getattr__ = lazy_page(__name__, __file__)
