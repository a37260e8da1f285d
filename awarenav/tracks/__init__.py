"""Tracks of the people in a file of estimates, drawn and tabulated: ``awarenav tracks``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._history import HistoryBuilder, TrackedRecording, TrackHistory, TrackSample
    from ._people_table import PeopleTable, PersonRow, person_id, read_people_table
    from ._plot import tracks_figure
    from ._recording import RecordedFrame, Recording, read_positions, read_recording
    from ._tracking import track_recording, tracks_in_file
    from ._truth import Truth, truth_beside_tracks

__all__ = [
    "HistoryBuilder",
    "PeopleTable",
    "PersonRow",
    "RecordedFrame",
    "Recording",
    "TrackHistory",
    "TrackSample",
    "TrackedRecording",
    "Truth",
    "person_id",
    "read_people_table",
    "read_positions",
    "read_recording",
    "track_recording",
    "tracks_figure",
    "tracks_in_file",
    "truth_beside_tracks",
]

__getattr__ = lazy_page(__name__, __file__)
