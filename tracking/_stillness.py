"""An upper bound of how far a person has moved from where they stood in the last second.

A velocity from a constant-velocity filter shows a start late: it must not follow the noise. Places
show it sooner, and how far somebody has come bounds how fast they are. With accelerations up to a,
somebody who is at most d away from where they stood is no faster than √(2 a d), and has been
speeding up for no longer than √(2 d / a).

The tracker keeps each person's measured places of the last ``standing_window_s``. The places older
than 0.2 s give the place where the person stood, and the noise of the measurements: their scatter,
for each sensor apart, since two sensors see different sides of a body. The latest places, as many
as make the bound smallest, give the place now. The bound is the distance of the two, plus three
standard deviations, plus what the older places differ from each other by more than their noise.

Nobody has a bound whose window is not full enough, who was matched ambiguously or was out of sight
in it, or whose bound is so large that they do not stand.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._matching import Found
from ._measurement import Frame
from ._sensors import Sensors
from ._table import BoolArray, TrackTable

ComplexArray = NDArray[np.complex128]

# Younger places show where the person is, older ones where they stood.
_RECENT_S: Final = 0.2
_MOST_RECENT: Final = 10
# A sensor counts with this many older places, the oldest of them this share of the window old.
_LEAST_PLACES: Final = 8
_LEAST_SPAN: Final = 0.6
# One-sided 99.87 %.
_SIGMAS: Final = 3.0
# No scatter counts as smaller, per axis.
_LEAST_STD_M: Final = 0.004
# The older places are divided into so many equal times, to find errors that last and sway.
_PARTS: Final = 8
# Whoever may have moved farther does not stand.
_MOST_MOVED_M: Final = 0.06
# A repeated place is looked for among so many of the latest.
_MOST_REPEATED: Final = 16
# A longer time without a place, and somebody may have gone and come back.
_HOLE_S: Final = 0.25
# Acceleration for which the number of latest places is chosen.
_TYPICAL_MPS2: Final = 2.0


def with_places(tracks: TrackTable, frame: Frame, found: Found, sensors: Sensors) -> TrackTable:
    """Return the tracks with the places of a frame.

    A place that repeats an earlier one to the bit is left out: that is no new measurement. Where
    some sensors measure ranges, only these count.

    Args:
        tracks: after the frame's measurements, new tracks included.
        frame: of any sensor.
        found: which of them the frame shows.
        sensors: all sensors.
    """
    measures = sensors.all[frame.sensor].settings.measures_range or not sensors.mixed
    if not tracks.places.shape[1] or not len(tracks):
        return tracks
    doubtful = found.ambiguous | found.beyond
    rows = np.flatnonzero(found.seen & ~doubtful) if measures else np.empty(0, dtype=np.intp)
    rows = rows[~frame.measurements.weak[found.source[rows]]]
    if not rows.size and not doubtful.any():
        return tracks
    old, stamp = tracks.places, frame.stamp_s
    measured = frame.measurements.positions_odom_m[found.source[rows]]
    latest = old[rows, -_MOST_REPEATED:]
    repeated = (latest[:, :, 1:3] == measured[:, None]).all(axis=2)
    repeated &= (latest[:, :, 3] == frame.sensor) & (latest[:, :, 0] > -np.inf)
    fresh = ~repeated.any(axis=1)
    rows, measured = rows[fresh], measured[fresh]
    rest = np.ones(len(old), dtype=np.bool_)
    rest[rows] = False
    places = np.empty_like(old)
    places[:, :-1] = old[:, 1:]
    places[rest] = old[rest]
    places[rows[stamp - old[rows, -1, 0] > _HOLE_S], :, 0] = -np.inf
    places[rows, -1, 0], places[rows, -1, 3] = stamp, frame.sensor
    places[rows, -1, 1:3] = measured
    places[doubtful, :, 0] = -np.inf
    return tracks.replaced(places=places)


def moved(tracks: TrackTable, window_s: float | None) -> tuple[FloatArray, FloatArray]:
    """Return how far people may have moved from where they stood, and until when.

    Args:
        tracks: N tracks.
        window_s: how far back places count; None for nobody stands.

    Returns:
        (N,) metres, infinite for people who do not stand or of whom too little is known, and (N,)
        the stamps that these distances hold for; 0 where the distance is infinite.
    """
    moved_m, stamps_s = np.full(len(tracks), np.inf), np.zeros(len(tracks))
    if window_s is None:
        return moved_m, stamps_s
    rows = np.flatnonzero(tracks.confirmed & (tracks.places[:, -1, 0] > -np.inf))
    if rows.size:
        bounds_m, ages_s = _bounds(tracks.places[rows], window_s)
        stands = bounds_m <= _MOST_MOVED_M
        rows, bounds_m, ages_s = rows[stands], bounds_m[stands], ages_s[stands]
        moved_m[rows], stamps_s[rows] = bounds_m, tracks.places[rows, -1, 0] - ages_s
    return moved_m, stamps_s


def _bounds(places: FloatArray, window_s: float) -> tuple[FloatArray, FloatArray]:
    """Return the bounds (N,) and the ages (N,) of the latest places they are for, of (N, K, 4)."""
    age_s = places[:, -1:, 0] - places[:, :, 0]
    used = min(int((age_s <= window_s).any(axis=0).argmax()), age_s.shape[1] - _MOST_RECENT)
    places, age_s = places[:, used:], age_s[:, used:]
    older = (age_s >= _RECENT_S) & (age_s <= window_s)
    offset_m, weight, origin_m2 = _offsets(places, age_s, older, window_s)
    spread, excess_m = _lasting_errors(offset_m, weight * older, age_s, window_s)
    # The latest first.
    latest = slice(-1, -_MOST_RECENT - 1, -1)
    share = (weight * (age_s < _RECENT_S))[:, latest]
    total = np.cumsum(share, axis=1)
    known = (total > 0.0) & np.isfinite(origin_m2)[:, None]
    safe = np.where(total > 0.0, total, 1.0)
    mean_m = np.cumsum(share * offset_m[:, latest], axis=1) / safe
    ages = np.cumsum(share * np.where(share > 0.0, age_s[:, latest], 0.0), axis=1) / safe
    variance_m2 = 1.0 / safe + np.where(np.isfinite(origin_m2), origin_m2, 0.0)[:, None]
    error_m = _SIGMAS * np.sqrt(spread[:, None] * variance_m2)
    delay_s = np.where(known, ages + np.sqrt(2.0 * error_m / _TYPICAL_MPS2), np.inf)
    best = delay_s.argmin(axis=1)
    each = np.arange(len(places))
    bound_m = np.abs(mean_m[each, best]) + error_m[each, best] + excess_m
    # A single place far off is perhaps the first of a start, or of somebody else.
    single = share > 0.0
    noise_m = _SIGMAS * np.sqrt(spread[:, None] / np.where(single, share, 1.0))
    single_m = np.where(single, np.abs(offset_m[:, latest]) - noise_m, 0.0).max(axis=1)
    bound_m = np.maximum(bound_m, single_m)
    return np.where(known[each, best], bound_m, np.inf), ages[each, best]


def _offsets(
    places: FloatArray, age_s: FloatArray, older: BoolArray, window_s: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return places x + iy (N, K) from where the person stood, their weights (N, K), a variance.

    Each sensor has its own older places as origin, and weights of one over its variance per axis; 0
    for sensors with too few. The variance (N,) is that of the origins; infinite without any.
    """
    place_m = places[:, :, 1] + 1j * places[:, :, 2]
    offset_m, weight = np.zeros_like(place_m), np.zeros_like(age_s)
    origin_m2 = np.full(len(places), -np.inf)
    filled = np.isfinite(places[:, :, 0])
    for sensor in np.unique(places[:, :, 3]):
        own = filled & (places[:, :, 3] == sensor)
        base = (own & older).astype(np.float64)
        count = base.sum(axis=1)
        spans = np.where(base > 0.0, age_s, 0.0).max(axis=1) >= _LEAST_SPAN * window_s
        enough = (count >= _LEAST_PLACES) & spans
        if not enough.any():
            continue
        at_least_two = np.maximum(count, 2.0)
        origin_m = np.einsum("nk,nk->n", base, place_m) / at_least_two
        off_m = place_m - origin_m[:, None]
        squares = np.einsum("nk,nk->n", base, off_m.real**2 + off_m.imag**2)
        variance = np.maximum(squares / (2.0 * (at_least_two - 1.0)), _LEAST_STD_M**2)
        # A scatter of few places may come out too small.
        variance *= 1.0 + 1.0 / np.sqrt(at_least_two)
        mine = own & enough[:, None]
        offset_m = np.where(mine, off_m, offset_m)
        weight += mine / variance[:, None]
        origin_m2 = np.where(enough, np.maximum(origin_m2, variance / at_least_two), origin_m2)
    return offset_m, weight, np.where(origin_m2 > -np.inf, origin_m2, np.inf)


def _lasting_errors(
    offset_m: ComplexArray, weight: FloatArray, age_s: FloatArray, window_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return (N,) ≥ 1, by how much errors that last raise variances, and (N,) the sway, in metres.

    Noise that is independent from scan to scan averages out over each part of the window. What
    remains lasts longer. A part farther from the mean place than one standard deviation is sway, or
    an error that drifts.
    """
    count = len(offset_m)
    row, column = np.nonzero(weight > 0.0)
    number = (age_s[row, column] - _RECENT_S) / (window_s - _RECENT_S) * _PARTS
    part = row * _PARTS + np.minimum(number.astype(np.intp), _PARTS - 1)
    weights, off_m = weight[row, column], offset_m[row, column]
    total, x_m, y_m = (
        np.bincount(part, values, count * _PARTS).reshape(count, _PARTS)
        for values in (weights, weights * off_m.real, weights * off_m.imag)
    )
    filled = total > 0.0
    safe = np.where(filled, total, 1.0)
    mean_m = np.hypot(x_m, y_m) / safe
    ratio = np.where(filled, 0.5 * mean_m * mean_m * safe, 0.0).sum(axis=1)
    spread = ratio / np.maximum(filled.sum(axis=1), 1)
    beyond_m = np.where(filled, mean_m - 1.0 / np.sqrt(safe), 0.0).max(axis=1)
    return np.maximum(spread, 1.0), np.maximum(beyond_m, 0.0)
