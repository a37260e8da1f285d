"""The tracks at an instant as :class:`~tracking.PersonTrack` objects."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._awareness_update import belief_of
from ._faces import face_period_s
from ._noticed import noticed
from ._sensors import Sensors
from ._sizes import with_lasting
from ._step import TrackerState, predicted
from ._table import BoolArray, TrackTable
from ._track import PersonTrack, TrackStatus, trusted_track
from ._track_management import coasted_too_long, shown_empty
from ._twins import reported
from .awareness_filter import drift_unseen, estimate

# A sensor is silent when no frame has come for this many of its usual intervals.
_SILENT_PERIODS: Final = 2.5


def snapshots(state: TrackerState, stamp_s: float, sensors: Sensors) -> tuple[PersonTrack, ...]:
    """Return every track at ``stamp_s``, which is not before the state's own stamp.

    The time in between counts as unseen. It holds no frame that could have missed a person, so a
    tentative track is kept for ``confirm_window_s`` here, not only for ``max_tentative_gap_s``.
    """
    tracks, config = state.tracks, sensors.config
    if state.stamp_s is None or not len(tracks):
        return ()
    if stamp_s > state.stamp_s:
        tracks = tracks.take(~_expired(state, stamp_s, sensors))
    tracks = tracks.take(reported(tracks))
    if not len(tracks):
        return ()
    current = _current(state, tracks)
    if stamp_s > state.stamp_s:
        tracks = predicted(tracks, state.stamp_s, stamp_s, config)
    belief = belief_of(tracks)
    faces = state.faces
    # Frames of sensors that see no faces leave the belief where it was.
    if faces.stamp_s is not None and stamp_s > faces.stamp_s:
        belief = drift_unseen(
            belief,
            faces.stamp_s,
            stamp_s,
            tracks.evidence_stamps_s,
            face_period_s(tracks, faces, state.clocks, sensors),
            config.awareness,
        )
    estimated = estimate(belief, config.awareness)
    covariances = with_lasting(tracks, state.origin_odom_m, state.origin_velocity_mps)
    # The snapshots share these arrays.
    tracks.states.setflags(write=False)
    covariances.setflags(write=False)
    return tuple(
        map(
            trusted_track,
            tracks.ids.tolist(),
            [stamp_s] * len(tracks),
            _statuses(tracks.confirmed.tolist(), current.tolist()),
            tracks.states[:, :2],
            tracks.states[:, 2:],
            covariances,
            np.asarray(estimated.awareness).tolist(),
            np.asarray(estimated.awareness_std).tolist(),
            np.asarray(estimated.awareness_lower).tolist(),
            [config.stature_m] * len(tracks),
            (stamp_s - tracks.last_seen_s).tolist(),
            _places_empty(state, tracks, sensors),
            noticed(tracks, stamp_s, faces, state.clocks, sensors).tolist(),
        )
    )


def _expired(state: TrackerState, stamp_s: float, sensors: Sensors) -> BoolArray:
    """Return (N,) True for tracks that are not reported at ``stamp_s`` any more."""
    tracks, config = state.tracks, sensors.config
    kept_s = np.maximum(sensors.tentative_gaps_s(state.clocks), config.confirm_window_s)
    gaps_s = stamp_s - tracks.seen_stamps_s
    unconfirmed = ~tracks.confirmed & (gaps_s > kept_s).all(axis=1)
    stamps_s = np.full(len(sensors), stamp_s)
    return unconfirmed | coasted_too_long(tracks, stamps_s, config, sensors.has_view)


def _places_empty(state: TrackerState, tracks: TrackTable, sensors: Sensors) -> list[bool]:
    if state.stamp_s is None or not np.isfinite(tracks.passed_stamps_s).any():
        return [False] * len(tracks)
    empty: list[bool] = shown_empty(tracks, state.stamp_s, state.periods_s, sensors.config).tolist()
    return empty


def _current(state: TrackerState, tracks: TrackTable) -> BoolArray:
    """Return (N,) True for people in the latest frame of a sensor that is not silent."""
    current: BoolArray = tracks.last_seen_s == state.stamp_s
    now_s = state.stamp_s
    if len(state.clocks) < 2 or now_s is None:
        return current
    for index, clock in enumerate(state.clocks):
        limit_s = _SILENT_PERIODS * clock.period_s
        if clock.stamp_s is not None and now_s - clock.stamp_s <= limit_s < math.inf:
            current = current | (tracks.seen_stamps_s[:, index] == clock.stamp_s)
    return current


def _statuses(confirmed: list[bool], in_latest_frame: list[bool]) -> list[TrackStatus]:
    """Return the status of each track."""
    return [
        "tentative" if not is_confirmed else "confirmed" if is_seen else "coasting"
        for is_confirmed, is_seen in zip(confirmed, in_latest_frame, strict=True)
    ]
