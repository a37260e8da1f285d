"""The size of a person, which is wrong in the same way in every image of them.

A camera infers a range from the size that people are assumed to have. The error of a child is the
same in every frame, so that no number of frames averages it out: the filter has the other errors,
and each track has its lasting one beside it, as a share of the range (a consider parameter, as in
Schmidt's filter). It is added to what is reported.

What a scanner, a depth image or feet on the floor say of the size holds for the track. Later images
of the same person that show the size alone are placed with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._measurement import Frame, Measurements
from ._table import BoolArray, IndexArray, TrackTable

# Lasting error of a size against a measured range: a scanner sees legs, and limbs are not in
# proportion.
_RANGED_STD: Final = 0.03
# Added where the match is by the ray alone, which may be the image of somebody else: it takes half
# a dozen frames to be believed.
_BY_RAY_STD: Final = 0.2
# A track's size counts once its standard deviation is below this share of what the measurement has.
_KNOWN_SHARE: Final = 0.5
# The ray of somebody nearer than this is not well known.
_LEAST_RANGE_M: Final = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class Sized:
    """M measurements as each of N tracks takes them, with what is known of the tracks' sizes.

    Attributes:
        positions_odom_m: (N, M, 2) with the range corrected by the size of the track.
        scales: (N, M) factor of that correction.
        stds: (N, M) lasting relative standard deviation of the range that remains.
        extra: (N, M, 2, 2) to be added to the covariance of the difference between a track and a
            measurement: the lasting errors of both are one error, as far as both have it.
    """

    positions_odom_m: FloatArray
    scales: FloatArray
    stds: FloatArray
    extra: FloatArray

    def part(self, rows: IndexArray, measurements: IndexArray) -> Sized:
        """Return the part for some tracks and some measurements."""
        at = rows[:, None], measurements
        return Sized(self.positions_odom_m[at], self.scales[at], self.stds[at], self.extra[at])


def sized(
    tracks: TrackTable, measured: Measurements, origin_m: tuple[float, float] | None
) -> Sized | None:
    """Return the measurements as each track takes them; None if no range has a lasting error.

    Args:
        tracks: N tracks, predicted to the frame.
        measured: M measurements.
        origin_m: where the sensor without measured ranges stands, or stood last.
    """
    if origin_m is None or not len(tracks) or not len(measured):
        return None
    if not (tracks.lasting_stds.any() or measured.lasting_stds.any()):
        return None
    offsets = measured.positions_odom_m - origin_m
    variances = np.repeat(measured.lasting_stds[None] ** 2, len(tracks), axis=0)
    known = tracks.size_variances[:, None] < _KNOWN_SHARE**2 * variances
    known &= np.isfinite(measured.size_logs)
    logs = np.where(known, measured.size_logs - tracks.size_logs[:, None], 0.0)
    variances = np.where(known, tracks.size_variances[:, None], variances)
    scales = np.exp(logs)
    placed = offsets[None] * scales[..., None]
    # The lasting error of the better of the two is common to both.
    differing = np.abs(tracks.lasting_stds[:, None] ** 2 - variances)
    extra = differing[..., None, None] * (placed[..., :, None] * placed[..., None, :])
    return Sized(placed + origin_m, scales, np.sqrt(variances), extra)


def without_lasting(
    tracks: TrackTable,
    frame: Frame,
    found: Sized,
    rows: IndexArray,
    columns: IndexArray,
    velocity_mps: tuple[float, float],
    origin_m: tuple[float, float],
) -> tuple[FloatArray, Frame]:
    """Return the covariances (K, 4, 4) of matched tracks, and the frame as these tracks take it.

    Whichever of track and measurement has the larger lasting error yields to the other.
    """
    covariances, measured = tracks.covariances[rows], frame.measurements
    worse = tracks.lasting_stds[rows] ** 2 - found.stds[rows, columns] ** 2
    b = _lever(tracks, origin_m, velocity_mps)[rows]
    covariances = covariances + np.maximum(worse, 0.0)[:, None, None] * (
        b[:, :, None] * b[:, None, :]
    )
    positions, noises = measured.positions_odom_m.copy(), measured.noises_m2.copy()
    positions[columns] = found.positions_odom_m[rows, columns]
    noises[columns] *= (found.scales[rows, columns] ** 2)[:, None, None]
    noises[columns] += np.where(worse[:, None, None] < 0.0, found.extra[rows, columns], 0.0)
    changed = replace(measured, positions_odom_m=positions, noises_m2=noises)
    return covariances, replace(frame, measurements=changed)


def lasting_after(
    tracks: TrackTable,
    found: Sized,
    rows: IndexArray,
    columns: IndexArray,
    covariances: FloatArray,
    noises_m2: FloatArray,
    origin_m: tuple[float, float],
) -> FloatArray:
    """Return the lasting errors (N,) of the tracks after a frame.

    They go over to that of the measurement by as much as the range does.

    Args:
        tracks: before the correction.
        found: the measurements.
        rows: (K,) of the matched tracks.
        columns: (K,) of their measurements.
        covariances: (K, 4, 4) of the tracks, as corrected.
        noises_m2: (K, 2, 2) of the measurements.
        origin_m: of the sensor without measured ranges.
    """
    ray = _rays(tracks.states[rows, :2] - origin_m)
    own = np.einsum("ki,kij,kj->k", ray, covariances[:, :2, :2], ray)
    other = np.einsum("ki,kij,kj->k", ray, noises_m2, ray)
    gain = own / (own + other)
    stds = np.array(tracks.lasting_stds)
    stds[rows] += gain * (found.stds[rows, columns] - stds[rows])
    return np.asarray(stds)


def with_sizes(
    tracks: TrackTable,
    measured: Measurements,
    source: IndexArray,
    certain: BoolArray,
    beyond: BoolArray,
    ranged: BoolArray,
    origin_m: tuple[float, float] | None,
) -> TrackTable:
    """Return the tracks with what a frame of a sensor without measured ranges says of their sizes.

    A size counts by Kalman's equation, and never for more than its lasting error allows.

    Args:
        tracks: after the frame.
        measured: as the sensor gives it.
        source: (N,) row of each track's measurement, −1 for none.
        certain: (N,) True for tracks with a measurement that is surely theirs.
        beyond: (N,) True for matches by the ray alone.
        ranged: (N,) True for tracks whose range was measured lately.
        origin_m: of the sensor.
    """
    logs, variances = tracks.size_logs, tracks.size_variances
    rows = np.flatnonzero(certain)
    rows = rows[np.isfinite(measured.size_logs[source[rows]])]
    if origin_m is None or not rows.size:
        return tracks
    columns = source[rows]
    value, lasting = measured.size_logs[columns], measured.lasting_stds[columns] ** 2
    own = measured.size_variances[columns] + np.where(beyond[rows], _BY_RAY_STD**2, 0.0)
    offset = tracks.states[rows, :2] - origin_m
    range_m = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), _LEAST_RANGE_M)
    placed = measured.positions_odom_m[columns] - origin_m
    placed_m = np.maximum(np.hypot(placed[:, 0], placed[:, 1]), _LEAST_RANGE_M)
    ray = _rays(offset)
    spread = np.einsum("ki,kij,kj->k", ray, tracks.covariances[rows, :2, :2], ray) / range_m**2
    by_range = ranged[rows] & (lasting > _RANGED_STD**2)
    value = np.where(by_range, value + np.log(placed_m / range_m), value)
    lasting = np.where(by_range, _RANGED_STD**2, lasting)
    own = np.where(by_range, own + spread, own)
    before = variances[rows]
    news = lasting < before
    with np.errstate(invalid="ignore"):
        gain = np.where(np.isfinite(before), before / (before + own + lasting), 1.0)
        after = np.where(np.isfinite(before), (1.0 - gain) * before, own + lasting)
    logs, variances = logs.copy(), variances.copy()
    logs[rows] += np.where(news, gain * (value - logs[rows]), 0.0)
    variances[rows] = np.where(news, np.maximum(after, lasting), before)
    return tracks.replaced(size_logs=logs, size_variances=variances)


def with_sizes_forgotten(tracks: TrackTable, ambiguous: BoolArray) -> TrackTable:
    """Return the tracks, without the sizes of those (N,) that may have become another person's."""
    if not ambiguous.any():
        return tracks
    return tracks.replaced(
        size_logs=np.where(ambiguous, 0.0, tracks.size_logs),
        size_variances=np.where(ambiguous, np.inf, tracks.size_variances),
    )


def with_lasting(
    tracks: TrackTable, origin_m: tuple[float, float] | None, velocity_mps: tuple[float, float]
) -> FloatArray:
    """Return the covariances (N, 4, 4) of the tracks with their lasting errors.

    A range that is wrong by a share scales place and velocity relative to the sensor by it.
    """
    if origin_m is None or not tracks.lasting_stds.any():
        return tracks.covariances
    b = tracks.lasting_stds[:, None] * _lever(tracks, origin_m, velocity_mps)
    return np.asarray(tracks.covariances + b[:, :, None] * b[:, None, :])


def _lever(
    tracks: TrackTable, origin_m: tuple[float, float], velocity_mps: tuple[float, float]
) -> FloatArray:
    """Return (N, 4), by how much a state moves per share of the range."""
    return np.asarray(tracks.states - np.array([*origin_m, *velocity_mps]))


def _rays(offsets_m: FloatArray) -> FloatArray:
    return np.asarray(
        offsets_m / np.maximum(np.hypot(offsets_m[:, 0], offsets_m[:, 1]), 1e-9)[:, None]
    )
