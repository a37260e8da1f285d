"""Evidence that a track is a person: the log-likelihood ratio of its detections to clutter.

The track score of Sittler (1964) with Wald's sequential test, as in Blackman and Popoli, "Design
and Analysis of Modern Tracking Systems" (1999), chapter 6.
"""

from __future__ import annotations

import math

import numpy as np

from perception.arrays import FloatArray
from perception.matrices import mahalanobis2

from ._config import TrackerConfig
from ._table import IndexArray, TrackTable

# The share of people who are missed so often in a row that a tentative track gives them up.
_GIVEN_UP = 0.01


def detection_logits(
    positions_m: FloatArray,
    covariances_m2: FloatArray,
    measured_m: FloatArray,
    noises_m2: FloatArray,
    config: TrackerConfig,
) -> FloatArray:
    """Return (N,) log-likelihood ratios of N matched measurements: of the track, or clutter.

    ln(P_D N(z; ẑ, S) / β), with β from ``miss_cost``.

    Args:
        positions_m: (N, 2) predicted positions.
        covariances_m2: (N, 2, 2) of the predicted positions.
        measured_m: (N, 2) measured positions.
        noises_m2: (N, 2, 2) of the measured positions.
        config: settings.
    """
    spread = covariances_m2 + noises_m2
    d2 = mahalanobis2(measured_m - positions_m, spread)
    determinant = spread[:, 0, 0] * spread[:, 1, 1] - spread[:, 0, 1] ** 2
    return np.asarray(
        0.5 * (config.miss_cost - d2 - np.log(determinant))
        + math.log1p(-config.detection_probability)
    )


def with_evidence(
    tracks: TrackTable,
    rows: IndexArray,
    logits: FloatArray,
    dt_s: float,
    config: TrackerConfig,
    sensor: int,
) -> TrackTable:
    """Return the tracks with the evidence of one frame, ``dt_s`` after the frame before.

    Frames closer than ``detection_correlation_s`` share their errors, clutter included. So a frame
    counts in proportion to the time that it stands for, and a faster camera adds no certainty.

    Args:
        tracks: N tracks.
        rows: (K,) tracks that the frame shows; each of the others that the sensor has seen before
            was missed.
        logits: (K,) evidence of these detections.
        dt_s: ≥ 0 since the sensor's frame before; 0 for a second frame with one stamp, which adds
            nothing.
        config: settings.
        sensor: index of the sensor.
    """
    if tracks.confirmed.all() or dt_s <= 0.0:
        return tracks
    weight = 1.0
    if config.detection_correlation_s > 0.0:
        weight = min(1.0, dt_s / config.detection_correlation_s)
    missed = math.log1p(-config.detection_probability)
    gain = np.where(np.isfinite(tracks.seen_stamps_s[:, sensor]), missed, 0.0)
    gain[rows] = logits
    return tracks.replaced(existence_logits=tracks.existence_logits + weight * gain)


def confirming_logit(period_s: float, config: TrackerConfig) -> float:
    """Return the evidence that confirms a track, given the time between frames.

    By Wald's bound, clutter confirms at most exp(−logit) of the tracks that it starts. It starts
    more of them per second with a faster camera, so the logit depends on the frame rate such that
    the number of false people per second does not.
    """
    return config.confirm_logit - math.log(period_s)


def tentative_gap_s(period_s: float, config: TrackerConfig) -> float:
    """Return the time after which an unseen tentative track is deleted.

    It covers as many frames in a row as miss a person in all but 1 % of cases, and at least
    ``max_tentative_gap_s``.
    """
    frames = math.ceil(math.log(_GIVEN_UP) / math.log1p(-config.detection_probability) - 1e-9)
    covered_s = (frames + 0.5) * period_s if math.isfinite(period_s) else 0.0
    return max(config.max_tentative_gap_s, covered_s)
