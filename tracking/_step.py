"""One frame's work, as a function from the tracker's state to its next one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from ._association import Gates, associate
from ._attention import attend
from ._config import TrackerConfig
from ._kalman import correct
from ._measurement import Frame
from ._motion import carry
from ._table import BoolArray, IndexArray, TrackTable
from ._track_management import after_hits, damped_time_s, gone, lost, missed_time_s
from ._views import View
from .awareness_filter import prior


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """All that frames change. States are values: a new frame makes a new one.

    Attributes:
        tracks: at ``stamp_s``.
        next_id: of the next track.
        stamp_s: of the latest frame, or None before the first.
        interval_s: between the latest two stamps that differ; infinite before there are two.
    """

    tracks: TrackTable
    next_id: int = 1
    stamp_s: float | None = None
    interval_s: float = math.inf


def gates_of(config: TrackerConfig) -> Gates:
    """Return the gates that a config describes."""
    return Gates(
        mahalanobis2=float(chi2.ppf(config.gate_probability, df=2)),
        distance_m=config.gate_distance_m,
        miss_cost=config.miss_cost,
        ambiguity_margin=config.ambiguity_margin,
        ambiguity_distance_m=config.ambiguity_distance_m,
    )


def advance(
    state: TrackerState, frame: Frame, config: TrackerConfig, gates: Gates, view: View | None
) -> TrackerState:
    """Return the state after one more frame, whose stamp is not before the state's."""
    stamp = frame.stamp_s
    previous = stamp if state.stamp_s is None else state.stamp_s
    dt_s = stamp - previous
    interval_s = dt_s if dt_s > 0.0 else state.interval_s
    tracks = state.tracks
    measured = frame.measurements
    if len(tracks) and dt_s > 0.0:
        tracks = moved(_findable(tracks, stamp, config, view), previous, stamp, config)
    tracks, source, ambiguous = _follow(tracks, frame, interval_s, config, gates)
    unclaimed = np.ones(len(measured), dtype=np.bool_)
    unclaimed[source[source >= 0]] = False
    if unclaimed.any():
        born = _born(frame, unclaimed, state.next_id, config)
        tracks = tracks.append(born)
        source = np.concatenate((source, np.flatnonzero(unclaimed)))
        ambiguous = np.concatenate((ambiguous, born.standing))  # nobody new is in doubt
    seen = source >= 0
    means, variances = np.full(len(tracks), np.nan), np.full(len(tracks), np.nan)
    means[seen] = measured.evidence_means[source[seen]]
    variances[seen] = measured.evidence_variances[source[seen]]
    tracks = attend(
        tracks,
        previous,
        stamp,
        interval_s,
        seen,
        ambiguous,
        means,
        variances,
        config.awareness,
    )
    missed_s = missed_time_s(tracks, ~seen, dt_s, frame.T_odom_camera, config, view)
    tracks = tracks.replaced(missed_s=missed_s)
    if not seen.all():
        tracks = tracks.take(seen | ~gone(tracks, stamp, config, view is not None))
    next_id = state.next_id + int(np.count_nonzero(unclaimed))
    return TrackerState(tracks, next_id, stamp, interval_s)


def moved(tracks: TrackTable, from_s: float, to_s: float, config: TrackerConfig) -> TrackTable:
    """Return the tracks with places and velocities carried from one stamp to a later one."""
    if not len(tracks):
        return tracks
    states, covariances = carry(
        tracks.states,
        tracks.covariances,
        to_s - from_s,
        damped_time_s(tracks, from_s, to_s),
        config.standing_time_constant_s,
        config.acceleration_density_m2ps3,
    )
    return tracks.replaced(states=states, covariances=covariances)


def _findable(
    tracks: TrackTable, stamp_s: float, config: TrackerConfig, view: View | None
) -> TrackTable:
    """Return the tracks without those that ran out of time before the frame.

    A tentative track gets its chance in this frame, however long the frame took.
    """
    has_view = view is not None
    gap_s = stamp_s - tracks.last_seen_s
    forgotten = ~tracks.confirmed & (gap_s > max(config.max_coast_s, config.max_tentative_gap_s))
    return tracks.take(~(lost(tracks, stamp_s, config, has_view) | forgotten))


def _follow(
    tracks: TrackTable, frame: Frame, interval_s: float, config: TrackerConfig, gates: Gates
) -> tuple[TrackTable, IndexArray, BoolArray]:
    """Let the tracks take the frame's measurements.

    Returns:
        The tracks with their places corrected; (N,) the row of the measurement that each took, −1
        for none; (N,) whether that match is in doubt.
    """
    source = np.full(len(tracks), -1, dtype=np.intp)
    ambiguous = np.zeros(len(tracks), dtype=np.bool_)
    measured = frame.measurements
    matches = associate(
        tracks.states[:, :2],
        tracks.covariances[:, :2, :2],
        tracks.confirmed,
        measured.positions_odom_m,
        measured.noises_m2,
        gates,
    )
    rows, columns = matches.tracks, matches.measurements
    if not rows.size:
        return tracks, source, ambiguous
    source[rows], ambiguous[rows] = columns, matches.ambiguous
    # What may be somebody else's measurement counts for less, and leaves more uncertainty.
    factors = np.where(matches.ambiguous, config.ambiguous_noise_factor, 1.0)
    states, covariances = tracks.states.copy(), tracks.covariances.copy()
    states[rows], covariances[rows] = correct(
        states[rows],
        covariances[rows],
        measured.positions_odom_m[columns],
        measured.noises_m2[columns] * factors[:, None, None],
    )
    tracks = tracks.replaced(states=states, covariances=covariances)
    return after_hits(tracks, rows, frame.stamp_s, interval_s, config), source, ambiguous


def _born(frame: Frame, unclaimed: BoolArray, first_id: int, config: TrackerConfig) -> TrackTable:
    """Return new tracks at the measurements that no track took, with nothing known of awareness."""
    count = int(np.count_nonzero(unclaimed))
    measured = frame.measurements
    states = np.zeros((count, 4))
    states[:, :2] = measured.positions_odom_m[unclaimed]
    covariances = np.zeros((count, 4, 4))
    covariances[:, :2, :2] = measured.noises_m2[unclaimed]
    covariances[:, 2, 2] = covariances[:, 3, 3] = config.initial_velocity_std_mps**2
    hits = np.full((count, config.confirm_hits), -np.inf)
    hits[:, -1] = frame.stamp_s
    belief = prior(config.awareness)
    return TrackTable(
        ids=np.arange(first_id, first_id + count, dtype=np.int64),
        states=states,
        covariances=covariances,
        awareness_means=np.full(count, belief.mean),
        awareness_variances=np.full(count, belief.variance),
        awareness_bounds=np.full(count, belief.bound),
        evidence_stamps_s=np.full(count, np.nan),
        hit_stamps_s=hits,
        confirmed=np.full(count, config.confirm_hits <= 1),
        standing=np.zeros(count, dtype=np.bool_),
        missed_s=np.zeros(count),
    )
