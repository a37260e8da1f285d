"""Track management: initiation, confirmation, coasting and deletion of tracks.

A confirmed track is deleted soon if frames should have shown the person and did not. How surely a
frame should have shown a person depends on the view and on the people who stand in front.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import mahalanobis2

from ._config import TrackerConfig
from ._errors import TrackingError
from ._existence import confirming_logit
from ._exits import floor_places
from ._measurement import Frame
from ._table import BoolArray, IndexArray, TrackTable
from ._views import RangedView, View
from .awareness_filter import prior

# χ² with two degrees of freedom: 90 % of the estimated velocities of a standing person pass.
_STANDING_CHI2: Final = 4.605
# A standing person is predicted with constant velocity for this long after the last sighting.
_STANDING_HOLD_S: Final = 0.5
# One frame counts for at most this share of max_missed_s, however long the pause before it.
_MAX_SHARE_OF_ONE_FRAME: Final = 0.5
# A place is empty if nobody is within so many standard deviations of where the person should be.
_PLACE_SIGMAS: Final = 2.0


def initiate(
    frame: Frame, unmatched: BoolArray, first_id: int, config: TrackerConfig, sensors: int = 1
) -> TrackTable:
    """Return new tracks at the unmatched measurements (M,), with the prior awareness.

    ``sensors`` is the number of sensors that the tracker has.
    """
    count = int(np.count_nonzero(unmatched))
    measured = frame.measurements
    states = np.zeros((count, 4))
    states[:, :2] = measured.positions_odom_m[unmatched]
    covariances = np.zeros((count, 4, 4))
    covariances[:, :2, :2] = measured.noises_m2[unmatched]
    covariances[:, 2, 2] = covariances[:, 3, 3] = config.initial_velocity_std_mps**2
    hits = np.full((count, config.confirm_hits), -np.inf)
    hits[:, -1] = frame.stamp_s
    seen_stamps = np.full((count, sensors), -np.inf)
    seen_stamps[:, frame.sensor] = frame.stamp_s
    belief = prior(config.awareness)
    places = floor_places(states[:, :2], frame.T_odom_camera)
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
        seen_stamps_s=seen_stamps,
        missed_s=np.zeros((count, sensors)),
        passed_stamps_s=np.full((count, sensors), -np.inf),
        existence_logits=np.zeros(count),
        birth_stamps_s=np.full(count, frame.stamp_s),
        birth_places_camera_m=places,
        last_places_camera_m=places,
        host_ids=np.zeros(count, dtype=np.int64),
        twin_logits=np.zeros(count),
        twin_visibilities=np.ones(count),
        twin_priors=np.zeros(count),
        twins=np.zeros(count, dtype=np.bool_),
        looked_s=np.zeros(count),
        look_stamps_s=np.full(count, np.nan),
        look_velocities_mps=np.zeros((count, 2)),
        look_speeds_mps=np.zeros(count),
        look_standing=np.zeros(count, dtype=np.bool_),
        averted_s=np.zeros(count),
        lasting_stds=measured.lasting_stds[unmatched],
        size_logs=np.zeros(count),
        size_variances=np.full(count, np.inf),
    )


def record_hits(
    tracks: TrackTable,
    rows: IndexArray,
    stamp_s: float,
    period_s: float,
    config: TrackerConfig,
    sensor: int = 0,
) -> TrackTable:
    """Return the tracks after a frame of a sensor at ``stamp_s`` that shows those of ``rows``.

    Confirms tracks with enough hits and finds out who stands. A second set of measurements with the
    same stamp is not another hit.
    """
    hits = tracks.hit_stamps_s.copy()
    fresh = rows[hits[rows, -1] < stamp_s]
    hits[fresh, :-1] = hits[fresh, 1:]
    hits[fresh, -1] = stamp_s
    seen_stamps = tracks.seen_stamps_s.copy()
    seen_stamps[rows, sensor] = stamp_s
    confirmed = tracks.confirmed
    if not confirmed.all():
        window_s = config.confirm_window_s
        if np.isfinite(period_s):
            window_s = max(window_s, (config.confirm_hits + 1) * period_s)
            sure = tracks.existence_logits[rows] >= confirming_logit(period_s, config)
            confirmed = confirmed.copy()
            confirmed[rows[sure]] = True
        confirmed = confirmed | (stamp_s - hits[:, 0] <= window_s)
    standing = tracks.standing.copy()
    standing[rows] = is_standing(tracks.states[rows], tracks.covariances[rows], config)
    return tracks.replaced(
        hit_stamps_s=hits, seen_stamps_s=seen_stamps, confirmed=confirmed, standing=standing
    )


def is_standing(states: FloatArray, covariances: FloatArray, config: TrackerConfig) -> BoolArray:
    """Return (N,) True for velocities that are small, well known and consistent with 0."""
    velocity, spread = states[:, 2:], covariances[:, 2:, 2:]
    v_x, v_y = velocity[:, 0], velocity[:, 1]
    limit2 = config.standing_speed_mps**2
    slow = v_x * v_x + v_y * v_y <= limit2
    well_known = spread[:, 0, 0] + spread[:, 1, 1] <= 2.0 * limit2
    standing = slow & well_known
    if standing.any():
        standing &= mahalanobis2(velocity, spread) <= _STANDING_CHI2
    return standing


def damped_time_s(tracks: TrackTable, from_s: float, to_s: float) -> FloatArray | None:
    """Return (N,), the part of a step in which the velocity decays, or None if it is 0 for all.

    Only standing people have one. With constant velocity, an unseen standing person would drift off
    with the remaining estimated velocity, and its uncertainty, which grows with the cube of time,
    would cover the whole map. The time counts from the last sighting, so that the number of frames
    since then does not matter.
    """
    if not tracks.standing.any():
        return None
    since_s = np.maximum(tracks.last_seen_s + _STANDING_HOLD_S, from_s)
    damped_s = np.where(tracks.standing, np.maximum(to_s - since_s, 0.0), 0.0)
    return damped_s if damped_s.any() else None


def coasted_too_long(
    tracks: TrackTable, stamps_s: FloatArray, config: TrackerConfig, has_view: BoolArray
) -> BoolArray:
    """Return (N,) True for confirmed tracks that all sensors have not seen for too long.

    Args:
        tracks: N tracks.
        stamps_s: (S,) the stamp at which each sensor judges.
        config: settings.
        has_view: (S,) True for sensors whose view is known.
    """
    gaps_s = stamps_s - tracks.seen_stamps_s
    standing_s = max(config.max_standing_coast_s, config.max_coast_s)
    limits_s = np.where(tracks.standing[:, None] & has_view, standing_s, config.max_coast_s)
    return np.asarray(tracks.confirmed & (gaps_s > limits_s).all(axis=1))


def expired_before(
    tracks: TrackTable,
    stamp_s: float,
    periods_s: FloatArray,
    config: TrackerConfig,
    has_view: BoolArray,
) -> BoolArray:
    """Return (N,) True for tracks that a frame at ``stamp_s`` can no longer match.

    A tentative track gets a chance in this frame, however long the frame interval.

    Args:
        tracks: N tracks.
        stamp_s: of the frame.
        periods_s: (S,) usual time between frames of each sensor, 0 if unknown.
        config: settings.
        has_view: (S,) True for sensors whose view is known.
    """
    gap_s = stamp_s - tracks.last_seen_s
    unconfirmed = ~tracks.confirmed & (gap_s > max(config.max_coast_s, config.max_tentative_gap_s))
    # A track that the last frame has left alive gets a chance too.
    return coasted_too_long(tracks, stamp_s - periods_s, config, has_view) | unconfirmed


def due_for_deletion(
    tracks: TrackTable,
    stamps_s: FloatArray,
    tentative_gaps_s: FloatArray,
    gone: BoolArray,
    config: TrackerConfig,
    has_view: BoolArray,
) -> BoolArray:
    """Return (N,) True for tracks to delete if the frame does not show them.

    Each sensor judges by its own frames, and all must agree. So a track is never given up sooner
    than it would be with one of the sensors alone. A sensor that has never seen a person agrees.

    Args:
        tracks: N tracks.
        stamps_s: (S,) the stamp at which each sensor judges: that of the frame for its own sensor,
            and for the others one usual interval less, since their next frame may show the person.
        tentative_gaps_s: (S,) the time after which each sensor gives up a tentative track.
        gone: (N, S) True for people who have walked out of a sensor's view; ``max_missed_s``
            suffices for them.
        config: settings.
        has_view: (S,) True for sensors whose view is known.
    """
    gaps_s = stamps_s - tracks.seen_stamps_s
    unconfirmed = ~tracks.confirmed & (gaps_s > tentative_gaps_s).all(axis=1)
    standing_s = max(config.max_standing_coast_s, config.max_coast_s)
    limits_s = np.where(tracks.standing[:, None] & has_view, standing_s, config.max_coast_s)
    lost = (gaps_s > limits_s) | (tracks.missed_s > config.max_missed_s)
    lost |= gone & (gaps_s > config.max_missed_s)
    return np.asarray(unconfirmed | (tracks.confirmed & lost.all(axis=1)))


def missed_time_s(
    tracks: TrackTable,
    unseen: BoolArray,
    dt_s: float,
    frame: Frame,
    config: TrackerConfig,
    view: View | None,
) -> FloatArray:
    """Return (N, S), the updated time in which frames should have shown the tracks and did not.

    The time since the sensor's previous frame counts in proportion to how surely this frame should
    have shown the person. Only people in this frame can hide others. Without a view it is 0.

    Args:
        tracks: at the frame's stamp.
        unseen: (N,) True for people who are not in the frame.
        dt_s: since the sensor's previous frame.
        frame: whose sensor's column changes.
        config: settings.
        view: where people can be seen by this sensor.
    """
    missed_s: FloatArray = tracks.missed_s.copy()
    missed_s[~unseen, frame.sensor] = 0.0
    candidates = unseen & tracks.confirmed
    if view is None or dt_s <= 0.0 or not candidates.any():
        return missed_s
    rows = np.flatnonzero(candidates)
    visibility = _visibility(tracks, rows, ~unseen, frame.T_odom_camera, config, view)
    share_s = min(dt_s, _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
    missed_s[rows, frame.sensor] += visibility * share_s
    return missed_s


def passed_stamps_s(
    tracks: TrackTable, unseen: BoolArray, frame: Frame, config: TrackerConfig, view: View | None
) -> FloatArray:
    """Return (N, S), ``passed_stamps_s`` after a frame.

    The place is as large as a body and two standard deviations of the position.

    Args:
        tracks: at the frame's stamp.
        unseen: (N,) True for people who are not in the frame.
        frame: whose sensor's column changes.
        config: settings.
        view: of the frame.
    """
    stamps_s: FloatArray = tracks.passed_stamps_s.copy()
    stamps_s[:, frame.sensor] = -np.inf
    rows = np.flatnonzero(unseen & tracks.confirmed)
    if not len(rows) or not isinstance(view, RangedView):
        return stamps_s
    spread = tracks.covariances[rows, :2, :2]
    half = 0.5 * (spread[:, 0, 0] - spread[:, 1, 1])
    largest = 0.5 * (spread[:, 0, 0] + spread[:, 1, 1]) + np.hypot(half, spread[:, 0, 1])
    radii_m = config.body_radius_m + _PLACE_SIGMAS * np.sqrt(largest)
    passed = view.passed(tracks.states[rows, :2], radii_m, frame.T_odom_camera)
    stamps_s[rows[passed], frame.sensor] = frame.stamp_s
    return stamps_s


def shown_empty(
    tracks: TrackTable, stamp_s: float, periods_s: FloatArray, config: TrackerConfig
) -> BoolArray:
    """Return (N,) True where the next frame without the person would end the track, rightly.

    The sensor that saw the person last must have missed them: another one may never have been able
    to see them, for a reason that its view does not know. And the latest frame of it, or of a
    sensor that saw them until shortly before, must have shown the place empty. Frames may come as
    much as a half later than usual.

    Args:
        tracks: N tracks.
        stamp_s: of the latest frame.
        periods_s: (S,) usual time between frames of each sensor, 0 if unknown.
        config: settings.
    """
    last = tracks.seen_stamps_s.argmax(axis=1)
    share_s = np.minimum(1.5 * periods_s, _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
    missed_s = tracks.missed_s[np.arange(len(tracks)), last] + share_s[last]
    lately = tracks.seen_stamps_s >= tracks.last_seen_s[:, None] - config.max_missed_s
    passed = (lately & (tracks.passed_stamps_s >= stamp_s - 1.5 * periods_s)).any(axis=1)
    return np.asarray(tracks.confirmed & (missed_s > config.max_missed_s) & passed)


def _visibility(
    tracks: TrackTable,
    rows: IndexArray,
    seen: BoolArray,
    T_odom_camera: FloatArray,
    config: TrackerConfig,
    view: View,
) -> FloatArray:
    """Return (K,) in [0, 1]: how surely the frame should have shown the tracks of ``rows`` (K,).

    Evaluated at the track's position only, not over its uncertainty: an empty visible part of the
    uncertain area does not rule out a person in the hidden part.
    """
    positions = tracks.states[rows, :2]
    in_view = np.asarray(view.visibility(positions, T_odom_camera), dtype=np.float64)
    if in_view.shape != (len(positions),) or not ((in_view >= 0.0) & (in_view <= 1.0)).all():
        raise TrackingError(
            f"view.visibility must return one number in [0, 1] per position, {len(positions)} in "
            f"all, got shape {in_view.shape}: {in_view!r:.80}"
        )
    share = unoccluded_share(
        positions,
        tracks.states[seen, :2],
        T_odom_camera[:2, 3],
        config.body_radius_m,
    )
    return np.asarray(in_view * share)


def unoccluded_share(
    positions_m: FloatArray,
    occluders_m: FloatArray,
    camera_m: FloatArray,
    radius_m: float,
) -> FloatArray:
    """Return (N,) in [0, 1]: the share of a body at each position that no nearer body hides.

    Bodies are upright cylinders, so each covers an interval of bearings on the floor plane. The
    shares that several people hide are summed: two people side by side can hide a third completely.

    Args:
        positions_m: (N, 2) positions of the bodies.
        occluders_m: (M, 2) positions of the other people.
        camera_m: (2,) position of the camera, in the same frame.
        radius_m: > 0, of every body.
    """
    if not len(positions_m) or not len(occluders_m):
        return np.ones(len(positions_m))
    bearing, distance, half = _bearing_intervals(positions_m, camera_m, radius_m)
    front_bearing, front_distance, front_half = _bearing_intervals(occluders_m, camera_m, radius_m)
    apart = bearing[:, None] - front_bearing
    apart = np.abs(np.mod(apart + np.pi, 2.0 * np.pi) - np.pi)
    overlap = np.minimum(half[:, None], apart + front_half) - np.maximum(
        -half[:, None], apart - front_half
    )
    in_front: BoolArray = front_distance + radius_m <= distance[:, None]
    hidden = np.where(in_front, np.clip(overlap / (2.0 * half[:, None]), 0.0, 1.0), 0.0)
    return np.asarray(np.maximum(1.0 - hidden.sum(axis=1), 0.0))


def _bearing_intervals(
    positions_m: FloatArray, camera_m: FloatArray, radius_m: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bearing, distance and angular half-width of bodies at (N, 2), seen from (2,)."""
    offset = positions_m - camera_m
    distance = np.hypot(offset[:, 0], offset[:, 1])
    half = np.arcsin(np.minimum(radius_m / np.maximum(distance, radius_m), 1.0))
    return np.arctan2(offset[:, 1], offset[:, 0]), distance, half
