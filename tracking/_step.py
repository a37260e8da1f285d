"""One step of the tracker, as a function from its state and a frame to its next state."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._awareness_update import forgotten, update_awareness
from ._clocks import FrameClock
from ._config import TrackerConfig
from ._exits import Exits, absence_s, walked_out
from ._faces import evidence_interval_s, face_period_s
from ._fusion import RANGED_S, duplicates
from ._matching import Found, match_frame
from ._measurement import Frame, Measurements
from ._motion import predict
from ._noticed import with_noticed
from ._sensors import Sensors, seen_lately
from ._sizes import with_sizes, with_sizes_forgotten
from ._table import BoolArray, TrackTable
from ._track_management import (
    damped_time_s,
    due_for_deletion,
    expired_before,
    initiate,
    missed_time_s,
    passed_stamps_s,
)
from ._twins import doubted, with_hosts, with_lower_evidence, with_twins, without

# Of two frames nearer to each other, the camera's velocity is not known.
_LEAST_STEP_S: Final = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class TrackerState:
    """Everything that frames change. A state is immutable: each frame makes a new one.

    Attributes:
        tracks: at ``stamp_s``, and their awareness at the stamp of ``faces``.
        clocks: of each sensor's frames.
        next_id: of the next track.
        stamp_s: of the latest frame of any sensor, or None before the first.
        faces: clock of the frames of all sensors that see faces.
        exits: where people have appeared before the camera and vanished.
        origin_odom_m: x and y of the latest sensor without measured ranges, or None before it.
        origin_velocity_mps: of that sensor, from its latest two frames.
    """

    tracks: TrackTable
    clocks: tuple[FrameClock, ...] = (FrameClock(),)
    next_id: int = 1
    stamp_s: float | None = None
    faces: FrameClock = field(default_factory=FrameClock)
    exits: Exits = field(default_factory=Exits.none)
    origin_odom_m: tuple[float, float] | None = None
    origin_velocity_mps: tuple[float, float] = (0.0, 0.0)

    @property
    def periods_s(self) -> FloatArray:
        """(S,) usual time between frames of each sensor, 0 where it is unknown."""
        periods = [clock.period_s for clock in self.clocks]
        return np.array([one if math.isfinite(one) else 0.0 for one in periods])


def nobody(config: TrackerConfig, sensors: Sensors, next_id: int = 1) -> TrackerState:
    """Return the state before the first frame."""
    table = TrackTable.empty(config.confirm_hits, len(sensors))
    return TrackerState(table, (FrameClock(),) * len(sensors), next_id)


def advance(state: TrackerState, frame: Frame, sensors: Sensors) -> TrackerState:
    """Return the state after one more frame, whose stamp is not before the state's."""
    sensor, config = sensors.all[frame.sensor], sensors.all[frame.sensor].config
    stamp, given, earlier = frame.stamp_s, frame.measurements, state
    previous = stamp if state.stamp_s is None else state.stamp_s
    dt_s = state.clocks[sensor.index].dt_s(stamp)
    state = _with_clocks(state, frame, sensors)
    period_s = state.clocks[sensor.index].period_s
    tracks = state.tracks
    if len(tracks) and stamp > previous:
        expired = expired_before(tracks, stamp, state.periods_s, config, sensors.has_view)
        tracks = without(tracks, expired, config)
        tracks = predicted(tracks, previous, stamp, config)
    before = tracks
    tracks, found, frame = match_frame(
        tracks,
        frame,
        dt_s,
        state.origin_odom_m,
        state.origin_velocity_mps,
        state.clocks,
        sensors,
    )
    followed = None
    if len(sensors) > 1:
        own = np.arange(len(sensors)) == sensor.index
        followed = seen_lately(before, own, stamp, absence_s(period_s))
    tracks = with_twins(before, tracks, found.source, frame.measurements, dt_s, config, followed)
    exits = state.exits
    if sensor.index == 0:
        exits = exits.after_matches(before, tracks, stamp, period_s)
    tracks, found, next_id = _with_births(tracks, frame, found, state.next_id, sensors)
    tracks = _with_sizes(tracks, frame, given, found, state, sensors)
    tracks = _with_awareness(tracks, frame, found, earlier, state, sensors)
    tracks = with_noticed(before, tracks, frame, found, earlier.faces, dt_s, state.clocks, sensors)
    view = sensor.view if frame.view is None else frame.view
    tracks = tracks.replaced(
        missed_s=missed_time_s(tracks, ~found.seen, dt_s, frame, config, view),
        passed_stamps_s=passed_stamps_s(tracks, ~found.seen, frame, config, view),
    )
    tracks, exits = _without_deleted(tracks, exits, found.seen, frame, state, sensors)
    double = duplicates(tracks, frame, state.clocks, sensors)
    if double.any():
        tracks = without(tracks, double, config)
    return TrackerState(
        tracks,
        state.clocks,
        next_id,
        state.stamp_s,
        state.faces,
        exits,
        state.origin_odom_m,
        state.origin_velocity_mps,
    )


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


def _with_clocks(state: TrackerState, frame: Frame, sensors: Sensors) -> TrackerState:
    """Return the state with the clocks, and the place of the camera, after a frame."""
    sensor, stamp = sensors.all[frame.sensor], frame.stamp_s
    clocks, last_s = list(state.clocks), state.clocks[sensor.index].stamp_s
    clocks[sensor.index] = clocks[sensor.index].after(stamp)
    origin, velocity = state.origin_odom_m, state.origin_velocity_mps
    if not sensor.settings.measures_range:
        x_m, y_m = frame.T_odom_camera[:2, 3].tolist()
        if origin is not None and last_s is not None and stamp - last_s >= _LEAST_STEP_S:
            dt_s = stamp - last_s
            velocity = ((x_m - origin[0]) / dt_s, (y_m - origin[1]) / dt_s)
        origin = (x_m, y_m)
    faces = state.faces.after(stamp) if sensor.settings.sees_faces else state.faces
    return TrackerState(
        state.tracks,
        tuple(clocks),
        state.next_id,
        stamp,
        faces,
        state.exits,
        origin,
        velocity,
    )


def _with_births(
    tracks: TrackTable, frame: Frame, found: Found, next_id: int, sensors: Sensors
) -> tuple[TrackTable, Found, int]:
    """Return the tracks with new ones of the measurements that fit none, and the next free id."""
    unmatched = ~frame.measurements.weak
    unmatched[found.source[found.seen]] = False
    if not unmatched.any():
        return tracks, found, next_id
    config = sensors.all[frame.sensor].config
    initiated = initiate(frame, unmatched, next_id, config, len(sensors))
    tracks = with_hosts(tracks.append(initiated), len(initiated), config)
    births = np.flatnonzero(unmatched)
    return tracks, found.with_births(births), next_id + len(births)


def _with_sizes(
    tracks: TrackTable,
    frame: Frame,
    given: Measurements,
    found: Found,
    state: TrackerState,
    sensors: Sensors,
) -> TrackTable:
    """Return the tracks with what a frame, whose measurements were ``given``, says of sizes."""
    tracks = with_sizes_forgotten(tracks, found.ambiguous)
    if sensors.all[frame.sensor].settings.measures_range:
        return tracks
    certain = found.seen & ~found.ambiguous
    certain[found.seen] &= ~given.weak[found.source[found.seen]]
    ranged = seen_lately(tracks, sensors.ranging, frame.stamp_s, RANGED_S)
    return with_sizes(
        tracks, given, found.source, certain, found.beyond, ranged, state.origin_odom_m
    )


def _with_awareness(
    tracks: TrackTable,
    frame: Frame,
    found: Found,
    earlier: TrackerState,
    state: TrackerState,
    sensors: Sensors,
) -> TrackTable:
    """Return the tracks with their awareness after a frame.

    Args:
        tracks: after the frame's measurements, new tracks included.
        frame: of any sensor; one that sees no faces only takes awareness, where it is ambiguous.
        found: which of them the frame shows.
        earlier: with the clocks before this frame.
        state: with the clocks after it.
        sensors: all sensors.
    """
    config, faces = sensors.config.awareness, earlier.faces
    if not sensors.all[frame.sensor].settings.sees_faces:
        return forgotten(tracks, found.ambiguous, config)
    measured, stamp, seen = frame.measurements, frame.stamp_s, found.seen
    looked_at = seen.copy()  # a weak detection may be something else: no evidence of awareness
    looked_at[seen] = ~measured.weak[found.source[seen]]
    means, variances = np.full(len(tracks), np.nan), np.full(len(tracks), np.nan)
    means[seen] = measured.evidence_means[found.source[seen]]
    variances[seen] = measured.evidence_variances[found.source[seen]]
    if sensors.mixed:
        # On the same ray, but not at that range: perhaps the face of somebody else.
        means[found.beyond] = variances[found.beyond] = np.nan
    means, variances = with_lower_evidence(tracks, looked_at, means, variances)
    return update_awareness(
        tracks,
        stamp if faces.stamp_s is None else faces.stamp_s,
        stamp,
        evidence_interval_s(tracks, stamp, state.clocks[frame.sensor], sensors),
        face_period_s(tracks, faces, earlier.clocks, sensors),
        looked_at,
        found.ambiguous,
        means,
        variances,
        config,
    )


def _without_deleted(
    tracks: TrackTable,
    exits: Exits,
    seen: BoolArray,
    frame: Frame,
    state: TrackerState,
    sensors: Sensors,
) -> tuple[TrackTable, Exits]:
    """Return the tracks without those that the frame, the state's latest, ends; and the exits."""
    if seen.all():
        return tracks, exits
    gone = np.repeat(doubted(tracks)[:, None], len(sensors), axis=1)
    if frame.sensor == 0:
        gone[:, 0] |= walked_out(tracks, exits, ~seen, frame.T_odom_camera)
    slack_s = state.periods_s
    slack_s[frame.sensor] = 0.0
    deleted = ~seen & due_for_deletion(
        tracks,
        frame.stamp_s - slack_s,
        sensors.tentative_gaps_s(state.clocks),
        gone,
        sensors.config,
        sensors.has_view,
    )
    vanished = deleted & tracks.confirmed & ~tracks.standing & ~tracks.twins
    # Only where the camera was the last to see somebody is there an exit of its view.
    vanished &= tracks.seen_stamps_s[:, 0] == tracks.last_seen_s
    exits = exits.with_events(tracks.last_places_camera_m[vanished], returned=False)
    return without(tracks, deleted, sensors.all[frame.sensor].config), exits
