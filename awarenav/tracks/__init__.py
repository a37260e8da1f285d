"""Tracks of the people in a file of estimates, drawn and tabulated: ``awarenav tracks``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._file_tracks import tracks_in_file
    from ._history import HistoryBuilder, TrackedRecording, TrackHistory, TrackSample
    from ._page import track_colour
    from ._people_table import PeopleTable, PersonRow, person_id, read_people_table
    from ._plan_view import covariance_ellipse, path_arrows, plan_limits, view_edges_rad
    from ._plot import shown_tracks, tracks_figure
    from ._recording import ASSUMED_POSITION_STD_M, RecordedFrame, Recording, read_recording
    from ._tables import CSV_COLUMNS
    from ._tracking import track_recording
    from ._truth import (
        Truth,
        TruthMatch,
        match_truth,
        person_ids_text,
        true_people,
        truth_beside_tracks,
    )

__all__ = [
    "ASSUMED_POSITION_STD_M",
    "CSV_COLUMNS",
    "HistoryBuilder",
    "PeopleTable",
    "PersonRow",
    "RecordedFrame",
    "Recording",
    "TrackHistory",
    "TrackSample",
    "TrackedRecording",
    "Truth",
    "TruthMatch",
    "covariance_ellipse",
    "match_truth",
    "path_arrows",
    "person_id",
    "person_ids_text",
    "plan_limits",
    "read_people_table",
    "read_recording",
    "shown_tracks",
    "track_colour",
    "track_recording",
    "tracks_figure",
    "tracks_in_file",
    "true_people",
    "truth_beside_tracks",
    "view_edges_rad",
]

__getattr__ = lazy_page(__name__, __file__)
