"""The tracks at an instant as the world sees them."""

from __future__ import annotations

import numpy as np

from ._attention import belief_of
from ._config import TrackerConfig
from ._step import TrackerState, moved
from ._table import BoolArray, TrackTable
from ._track import PersonTrack, TrackStatus, trusted_track
from ._track_management import lost
from .awareness_filter import drift, estimate


def snapshots(
    state: TrackerState, stamp_s: float, config: TrackerConfig, has_view: bool
) -> tuple[PersonTrack, ...]:
    """Return every track at ``stamp_s``, not before the state's own stamp.

    The time in between counts as unseen. No frame looked, so nobody was missed: what would end a
    tentative track in a frame does not end it here before ``confirm_window_s``.
    """
    tracks = state.tracks
    if state.stamp_s is None or not len(tracks):
        return ()
    dt_s = stamp_s - state.stamp_s
    belief = belief_of(tracks)
    if dt_s > 0.0:
        tracks = tracks.take(~_absent(tracks, stamp_s, config, has_view))
        if not len(tracks):
            return ()
        tracks = moved(tracks, state.stamp_s, stamp_s, config)
        awareness = config.awareness
        unseen_s = max(awareness.unseen_time_constant_s, awareness.memory_s)
        belief = drift(belief_of(tracks), dt_s, unseen_s, awareness)
    told = estimate(belief, config.awareness)
    last_seen_s = tracks.last_seen_s
    # The snapshots share these arrays, which nothing writes to again.
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
            np.asarray(told.awareness).tolist(),
            np.asarray(told.awareness_std).tolist(),
            np.asarray(told.awareness_lower).tolist(),
            [config.stature_m] * len(tracks),
            (stamp_s - last_seen_s).tolist(),
        )
    )


def _absent(tracks: TrackTable, stamp_s: float, config: TrackerConfig, has_view: bool) -> BoolArray:
    """Return (N,) True for whoever is not told of at ``stamp_s`` any more."""
    patience_s = max(config.max_tentative_gap_s, config.confirm_window_s)
    given_up = ~tracks.confirmed & (stamp_s - tracks.last_seen_s > patience_s)
    return given_up | lost(tracks, stamp_s, config, has_view)


def _statuses(confirmed: list[bool], shown: list[bool]) -> list[TrackStatus]:
    """Return the statuses of tracks: whether confirmed, whether in the latest frame."""
    return [
        "tentative" if not sure else "confirmed" if now else "coasting"
        for sure, now in zip(confirmed, shown, strict=True)
    ]
