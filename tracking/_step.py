"""One step of the tracker, as a function from its state and a frame to its next state."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import gammaincinv

from ._association import Gates, associate
from ._awareness_update import update_awareness
from ._config import TrackerConfig
from ._existence import detection_logits, with_evidence
from ._exits import Exits, floor_places, walked_out
from ._kalman import correct
from ._measurement import Frame, Measurements
from ._motion import predict
from ._table import BoolArray, IndexArray, TrackTable
from ._track_management import (
    damped_time_s,
    due_for_deletion,
    expired_before,
    initiate,
    missed_time_s,
    record_hits,
)
from ._twins import doubted, same_person, with_hosts, with_lower_evidence, with_twins, without
from ._views import View

# Share of a new interval in the usual time between frames.
_PERIOD_GAIN = 0.2
# How far a person may walk between two frames, in standard deviations of a new track's velocity.
_REACH_SIGMAS = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """Everything that frames change. A state is immutable: each frame makes a new one.

    Attributes:
        tracks: at ``stamp_s``.
        next_id: of the next track.
        stamp_s: of the latest frame, or None before the first.
        interval_s: between the latest two stamps that differ; infinite before there are two.
        period_s: usual time between frames, smoothed over pauses; infinite before there are two.
        exits: where people have appeared and vanished.
    """

    tracks: TrackTable
    next_id: int = 1
    stamp_s: float | None = None
    interval_s: float = math.inf
    period_s: float = math.inf
    exits: Exits = field(default_factory=Exits.none)


def gates_of(config: TrackerConfig) -> Gates:
    """Return the gates that a config describes."""
    return Gates(
        # χ² with two degrees of freedom; scipy.stats would take most of the package's import time.
        mahalanobis2=float(2.0 * gammaincinv(1.0, config.gate_probability)),
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
    period_s = smoothed_period_s(state.period_s, dt_s)
    has_view = view is not None
    tracks = state.tracks
    measured = frame.measurements
    if len(tracks) and dt_s > 0.0:
        tracks = without(tracks, expired_before(tracks, stamp, period_s, config, has_view))
        tracks = predicted(tracks, previous, stamp, config)
    before = tracks
    tracks, source, ambiguous = _matched(tracks, frame, dt_s, period_s, config, gates)
    tracks = with_twins(before, tracks, source, measured, dt_s, config)
    exits = state.exits.after_matches(before, tracks, stamp, period_s)
    unmatched = ~measured.weak
    unmatched[source[source >= 0]] = False
    if unmatched.any():
        initiated = initiate(frame, unmatched, state.next_id, config)
        tracks = with_hosts(tracks.append(initiated), len(initiated), config)
        source = np.concatenate((source, np.flatnonzero(unmatched)))
        no_flags = np.zeros(len(initiated), dtype=np.bool_)
        ambiguous = np.concatenate((ambiguous, no_flags))  # a new track is never ambiguous
    seen = source >= 0
    looked_at = seen.copy()  # a weak detection may be something else: no evidence of awareness
    looked_at[seen] = ~measured.weak[source[seen]]
    means, variances = np.full(len(tracks), np.nan), np.full(len(tracks), np.nan)
    means[seen] = measured.evidence_means[source[seen]]
    variances[seen] = measured.evidence_variances[source[seen]]
    means, variances = with_lower_evidence(tracks, looked_at, means, variances)
    tracks = update_awareness(
        tracks,
        previous,
        stamp,
        interval_s,
        state.period_s,
        looked_at,
        ambiguous,
        means,
        variances,
        config.awareness,
    )
    missed_s = missed_time_s(tracks, ~seen, dt_s, frame.T_odom_camera, config, view)
    tracks = tracks.replaced(missed_s=missed_s)
    if not seen.all():
        gone = walked_out(tracks, exits, ~seen, frame.T_odom_camera) | doubted(tracks)
        deleted = ~seen & due_for_deletion(tracks, stamp, period_s, gone, config, has_view)
        vanished = deleted & tracks.confirmed & ~tracks.standing & ~tracks.twins
        exits = exits.with_events(tracks.last_places_camera_m[vanished], returned=False)
        tracks = without(tracks, deleted)
    next_id = state.next_id + int(np.count_nonzero(unmatched))
    return TrackerState(tracks, next_id, stamp, interval_s, period_s, exits)


def smoothed_period_s(period_s: float, dt_s: float) -> float:
    """Return the usual time between frames after one more interval; a pause counts as two."""
    if dt_s <= 0.0:
        return period_s
    if not math.isfinite(period_s):
        return dt_s
    return period_s + _PERIOD_GAIN * (min(dt_s, 2.0 * period_s) - period_s)


def predicted(tracks: TrackTable, from_s: float, to_s: float, config: TrackerConfig) -> TrackTable:
    """Return the tracks with positions and velocities predicted from one stamp to a later one."""
    if not len(tracks):
        return tracks
    states, covariances = predict(
        tracks.states,
        tracks.covariances,
        to_s - from_s,
        damped_time_s(tracks, from_s, to_s),
        config.standing_time_constant_s,
        config.acceleration_density_m2ps3,
    )
    return tracks.replaced(states=states, covariances=covariances)


def _matched(
    tracks: TrackTable,
    frame: Frame,
    dt_s: float,
    period_s: float,
    config: TrackerConfig,
    gates: Gates,
) -> tuple[TrackTable, IndexArray, BoolArray]:
    """Match the frame's measurements to the tracks and correct the tracks with them.

    Returns:
        The corrected tracks; (N,) the row of each track's measurement, −1 for none; (N,) True for
        ambiguous matches.
    """
    source = np.full(len(tracks), -1, dtype=np.intp)
    ambiguous = np.zeros(len(tracks), dtype=np.bool_)
    measured = frame.measurements
    if math.isfinite(period_s):
        reach_m = _REACH_SIGMAS * config.initial_velocity_std_mps * period_s
        gates = replace(gates, distance_m=max(gates.distance_m, reach_m))
    rows, columns, unclear = _matches(tracks, measured, gates)
    logits = detection_logits(
        tracks.states[rows, :2],
        tracks.covariances[rows, :2, :2],
        measured.positions_odom_m[columns],
        measured.noises_m2[columns],
        config,
    )
    tracks = with_evidence(tracks, rows, logits, dt_s, config)
    if not rows.size:
        return tracks, source, ambiguous
    source[rows], ambiguous[rows] = columns, unclear
    # An ambiguous measurement has less weight and leaves more uncertainty.
    factors = np.where(unclear, config.ambiguous_noise_factor, 1.0)
    states, covariances = tracks.states.copy(), tracks.covariances.copy()
    states[rows], covariances[rows] = correct(
        states[rows],
        covariances[rows],
        measured.positions_odom_m[columns],
        measured.noises_m2[columns] * factors[:, None, None],
    )
    places = tracks.last_places_camera_m.copy()
    places[rows] = floor_places(states[rows, :2], frame.T_odom_camera)
    tracks = tracks.replaced(states=states, covariances=covariances, last_places_camera_m=places)
    return record_hits(tracks, rows, frame.stamp_s, period_s, config), source, ambiguous


def _matches(
    tracks: TrackTable, measured: Measurements, gates: Gates
) -> tuple[IndexArray, IndexArray, BoolArray]:
    """Return (K,) rows of matched tracks, of their measurements, and which are ambiguous.

    Weak detections are offered to the confirmed tracks that are left without a match, as in
    ByteTrack (Zhang et al., ECCV 2022).
    """
    first, people = tracks.confirmed & ~doubted(tracks), same_person(tracks)
    positions, covariances = tracks.states[:, :2], tracks.covariances[:, :2, :2]
    places, noises = measured.positions_odom_m, measured.noises_m2
    if not measured.weak.any():
        found = associate(positions, covariances, first, places, noises, gates, people)
        return found.tracks, found.measurements, found.ambiguous
    offered = np.flatnonzero(~measured.weak)
    found = associate(
        positions, covariances, first, places[offered], noises[offered], gates, people
    )
    rows, columns = found.tracks, offered[found.measurements]
    left = tracks.confirmed.copy()
    left[rows] = False
    rest, offered = np.flatnonzero(left), np.flatnonzero(measured.weak)
    second = associate(
        positions[rest],
        covariances[rest],
        first[rest],
        places[offered],
        noises[offered],
        gates,
        None if people is None else people[rest],
    )
    return (
        np.concatenate((rows, rest[second.tracks])),
        np.concatenate((columns, offered[second.measurements])),
        np.concatenate((found.ambiguous, second.ambiguous)),
    )
