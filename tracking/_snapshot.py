"""The tracks at an instant as :class:`~tracking.PersonTrack` objects."""

from __future__ import annotations

import numpy as np

from ._awareness_update import belief_of
from ._config import TrackerConfig
from ._existence import tentative_gap_s
from ._step import TrackerState, predicted
from ._table import BoolArray, TrackTable
from ._track import PersonTrack, TrackStatus, trusted_track
from ._track_management import coasted_too_long
from ._twins import reported
from .awareness_filter import drift_unseen, estimate


def snapshots(
    state: TrackerState, stamp_s: float, config: TrackerConfig, has_view: bool
) -> tuple[PersonTrack, ...]:
    """Return every track at ``stamp_s``, which is not before the state's own stamp.

    The time in between counts as unseen. It holds no frame that could have missed a person, so a
    tentative track is kept for ``confirm_window_s`` here, not only for ``max_tentative_gap_s``.
    """
    tracks = state.tracks
    if state.stamp_s is None or not len(tracks):
        return ()
    dt_s = stamp_s - state.stamp_s
    if dt_s > 0.0:
        tracks = tracks.take(~_expired(tracks, stamp_s, state.period_s, config, has_view))
    tracks = tracks.take(reported(tracks))
    if not len(tracks):
        return ()
    belief = belief_of(tracks)
    if dt_s > 0.0:
        tracks = predicted(tracks, state.stamp_s, stamp_s, config)
        belief = drift_unseen(
            belief_of(tracks),
            state.stamp_s,
            stamp_s,
            tracks.evidence_stamps_s,
            state.period_s,
            config.awareness,
        )
    estimated = estimate(belief, config.awareness)
    last_seen_s = tracks.last_seen_s
    # The snapshots share these arrays.
    tracks.states.setflags(write=False)
    tracks.covariances.setflags(write=False)
    return tuple(
        map(
            trusted_track,
            tracks.ids.tolist(),
            [stamp_s] * len(tracks),
            _statuses(tracks.confirmed.tolist(), (last_seen_s == state.stamp_s).tolist()),
            tracks.states[:, :2],
            tracks.states[:, 2:],
            tracks.covariances,
            np.asarray(estimated.awareness).tolist(),
            np.asarray(estimated.awareness_std).tolist(),
            np.asarray(estimated.awareness_lower).tolist(),
            [config.stature_m] * len(tracks),
            (stamp_s - last_seen_s).tolist(),
        )
    )


def _expired(
    tracks: TrackTable, stamp_s: float, period_s: float, config: TrackerConfig, has_view: bool
) -> BoolArray:
    """Return (N,) True for tracks that are not reported at ``stamp_s`` any more."""
    kept_s = max(tentative_gap_s(period_s, config), config.confirm_window_s)
    unconfirmed = ~tracks.confirmed & (stamp_s - tracks.last_seen_s > kept_s)
    return unconfirmed | coasted_too_long(tracks, stamp_s, config, has_view)


def _statuses(confirmed: list[bool], in_latest_frame: list[bool]) -> list[TrackStatus]:
    """Return the status of each track."""
    return [
        "tentative" if not is_confirmed else "confirmed" if is_seen else "coasting"
        for is_confirmed, is_seen in zip(confirmed, in_latest_frame, strict=True)
    ]
