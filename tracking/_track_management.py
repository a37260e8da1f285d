"""How much of each person the people nearer to the camera hide.

Births and deaths: who counts as confirmed, who stands, and how long the unseen are kept.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._config import TrackerConfig
from ._errors import TrackingError
from ._kalman import inverse_2x2
from ._table import BoolArray, IndexArray, TrackTable
from ._views import View


def open_share(
    places_m: FloatArray,
    people_m: FloatArray,
    eye_m: FloatArray,
    radius_m: float,
) -> FloatArray:
    """Return (N,) in [0, 1]: the share of a body at each place that nobody nearer covers.

    Bodies are upright cylinders, so on the floor plane each takes up an interval of bearings. The
    shares that several people cover are summed: two who stand side by side hide somebody whole.

    Args:
        places_m: (N, 2) where somebody may be.
        people_m: (M, 2) the others, who may stand in front.
        eye_m: (2,) the camera, in the same frame.
        radius_m: > 0, of every body.
    """
    if not len(places_m) or not len(people_m):
        return np.ones(len(places_m))
    bearing, distance, half = _seen_from(places_m, eye_m, radius_m)
    front_bearing, front_distance, front_half = _seen_from(people_m, eye_m, radius_m)
    apart = bearing[:, None] - front_bearing
    apart = np.abs(np.mod(apart + np.pi, 2.0 * np.pi) - np.pi)
    overlap = np.minimum(half[:, None], apart + front_half) - np.maximum(
        -half[:, None], apart - front_half
    )
    before: BoolArray = front_distance + radius_m <= distance[:, None]
    hidden = np.where(before, np.clip(overlap / (2.0 * half[:, None]), 0.0, 1.0), 0.0)
    return np.asarray(np.maximum(1.0 - hidden.sum(axis=1), 0.0))


def _seen_from(
    places_m: FloatArray, eye_m: FloatArray, radius_m: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return bearing, distance and half the angle of bodies at (N, 2), seen from (2,)."""
    offset = places_m - eye_m
    distance = np.hypot(offset[:, 0], offset[:, 1])
    half = np.arcsin(np.minimum(radius_m / np.maximum(distance, radius_m), 1.0))
    return np.arctan2(offset[:, 1], offset[:, 0]), distance, half


# χ² with two degrees of freedom: nine velocities in ten of somebody who stands pass.
_STANDING_CHI2: Final = 4.605
# A constant velocity holds for this long after the last sight of somebody who stood.
_STANDING_HOLD_S: Final = 0.5
# However long the pause before it, one frame is no more than this share of max_missed_s.
_MAX_SHARE_OF_ONE_FRAME: Final = 0.5


def lost(tracks: TrackTable, stamp_s: float, config: TrackerConfig, has_view: bool) -> BoolArray:
    """Return (N,) True for confirmed tracks unseen for too long at ``stamp_s``, for any reason."""
    gap_s = stamp_s - tracks.last_seen_s
    if not has_view:
        return tracks.confirmed & (gap_s > config.max_coast_s)
    standing_s = max(config.max_standing_coast_s, config.max_coast_s)
    limit_s = np.where(tracks.standing, standing_s, config.max_coast_s)
    return tracks.confirmed & (gap_s > limit_s)


def gone(tracks: TrackTable, stamp_s: float, config: TrackerConfig, has_view: bool) -> BoolArray:
    """Return (N,) True for whoever is to be dropped at ``stamp_s`` if not seen then."""
    given_up = ~tracks.confirmed & (stamp_s - tracks.last_seen_s > config.max_tentative_gap_s)
    missed = tracks.confirmed & (tracks.missed_s > config.max_missed_s)
    return lost(tracks, stamp_s, config, has_view) | given_up | missed


def missed_time_s(
    tracks: TrackTable,
    unseen: BoolArray,
    dt_s: float,
    T_odom_camera: FloatArray,
    config: TrackerConfig,
    view: View | None,
) -> FloatArray:
    """Return (N,) how long frames should have shown the tracks and did not, after one more frame.

    The time since the frame before counts in proportion to how surely this one should have shown
    the person. Only people whom this very frame shows can hide others. Without a view it is 0.

    Args:
        tracks: at the frame's stamp.
        unseen: (N,) whom the frame does not show.
        dt_s: since the frame before.
        T_odom_camera: (4, 4) of the frame.
        config: settings.
        view: where people can be seen.
    """
    missed_s = np.where(unseen, tracks.missed_s, 0.0)
    asked = unseen & tracks.confirmed
    if view is None or dt_s <= 0.0 or not asked.any():
        return missed_s
    rows = np.flatnonzero(asked)
    visibility = _visibility(tracks, rows, ~unseen, T_odom_camera, config, view)
    missed_s[rows] += visibility * min(dt_s, _MAX_SHARE_OF_ONE_FRAME * config.max_missed_s)
    return missed_s


def _visibility(
    tracks: TrackTable,
    rows: IndexArray,
    shown: BoolArray,
    T_odom_camera: FloatArray,
    config: TrackerConfig,
    view: View,
) -> FloatArray:
    """Return (K,) in [0, 1]: how surely the frame should have shown the tracks of ``rows`` (K,).

    Judged where the track is, not all over its uncertainty: that nobody is seen in the open part
    of it does not speak against a person in the hidden part.
    """
    places = tracks.states[rows, :2]
    said = np.asarray(view.visibility(places, T_odom_camera), dtype=np.float64)
    if said.shape != (len(places),) or not ((said >= 0.0) & (said <= 1.0)).all():
        raise TrackingError(
            f"view.visibility must return one number in [0, 1] a position, {len(places)} in all, "
            f"got shape {said.shape}: {said!r:.80}"
        )
    share = open_share(
        places,
        tracks.states[shown, :2],
        T_odom_camera[:2, 3],
        config.body_radius_m,
    )
    return np.asarray(said * share)


def damped_time_s(tracks: TrackTable, from_s: float, to_s: float) -> FloatArray | None:
    """Return (N,) how much of a step the standing are modelled as staying where they are.

    Constant velocity would carry somebody who stands away on the rest of their estimated velocity,
    and its uncertainty, which grows with the cube of time, would fill the hall. Counted from the
    last sight of them, so that it does not matter how many frames came since. None for no one.
    """
    if not tracks.standing.any():
        return None
    since_s = np.maximum(tracks.last_seen_s + _STANDING_HOLD_S, from_s)
    damped_s = np.where(tracks.standing, np.maximum(to_s - since_s, 0.0), 0.0)
    return damped_s if damped_s.any() else None


def stand(states: FloatArray, covariances: FloatArray, config: TrackerConfig) -> BoolArray:
    """Return (N,) True for velocities that are small, well known and consistent with 0."""
    velocity, spread = states[:, 2:], covariances[:, 2:, 2:]
    v_x, v_y = velocity[:, 0], velocity[:, 1]
    limit2 = config.standing_speed_mps**2
    slow = v_x * v_x + v_y * v_y <= limit2
    sure = spread[:, 0, 0] + spread[:, 1, 1] <= 2.0 * limit2
    likely = slow & sure
    if likely.any():
        inverse = inverse_2x2(spread)
        chi2 = (
            v_x * v_x * inverse[:, 0, 0]
            + 2.0 * v_x * v_y * inverse[:, 0, 1]
            + v_y * v_y * inverse[:, 1, 1]
        )
        likely &= chi2 <= _STANDING_CHI2
    return likely


def after_hits(
    tracks: TrackTable,
    rows: IndexArray,
    stamp_s: float,
    interval_s: float,
    config: TrackerConfig,
) -> TrackTable:
    """Return the tracks after a frame at ``stamp_s`` that shows those of ``rows``.

    A second set of measurements of one instant is no second sighting.
    """
    hits = tracks.hit_stamps_s.copy()
    fresh = rows[hits[rows, -1] < stamp_s]
    hits[fresh, :-1] = hits[fresh, 1:]
    hits[fresh, -1] = stamp_s
    confirmed = tracks.confirmed
    if not confirmed.all():
        window_s = config.confirm_window_s
        if np.isfinite(interval_s):
            window_s = max(window_s, (config.confirm_hits + 1) * interval_s)
        confirmed = confirmed | (stamp_s - hits[:, 0] <= window_s)
    standing = tracks.standing.copy()
    standing[rows] = stand(tracks.states[rows], tracks.covariances[rows], config)
    return tracks.replaced(hit_stamps_s=hits, confirmed=confirmed, standing=standing)
