"""Update of every track's awareness with one frame."""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray

from ._config import AwarenessFilterConfig
from ._table import BoolArray, TrackTable
from .awareness_filter import AwarenessBelief, drift, forget, measure


def belief_of(tracks: TrackTable) -> AwarenessBelief:
    """Return the awareness of every track as a belief."""
    return AwarenessBelief(
        tracks.awareness_means, tracks.awareness_variances, tracks.awareness_bounds
    )


def update_awareness(
    tracks: TrackTable,
    previous_stamp_s: float,
    stamp_s: float,
    interval_s: float,
    seen: BoolArray,
    ambiguous: BoolArray,
    evidence_means: FloatArray,
    evidence_variances: FloatArray,
    config: AwarenessFilterConfig,
) -> TrackTable:
    """Return the tracks with their awareness after one frame.

    Args:
        tracks: with beliefs at ``previous_stamp_s``.
        previous_stamp_s: stamp of the frame before.
        stamp_s: stamp of the frame.
        interval_s: > 0, time that the frame stands for.
        seen: (N,) True for people in the frame.
        ambiguous: (N,) True for ambiguous matches: the belief drifts as if unseen and is then reset
            to the prior, since the measurement may be another person's.
        evidence_means: (N,) of logit(α); NaN without a usable face.
        evidence_variances: (N,) of logit(α); NaN without a usable face.
        config: settings.
    """
    dt_s = stamp_s - previous_stamp_s
    observed = seen & ~ambiguous
    shows_face = observed & ~np.isnan(evidence_means)
    before = belief_of(tracks)
    belief, stamps = before, tracks.evidence_stamps_s
    if dt_s > 0.0:
        unseen_s = max(config.unseen_time_constant_s, config.memory_s)
        no_face_s = max(config.no_face_time_constant_s, config.memory_s)
        # A face in two frames in a row counts for the time between them, unless it is long.
        continued = shows_face & (stamps == previous_stamp_s)
        continued &= dt_s <= config.max_evidence_gap_s
        constants_s = np.where(observed & ~shows_face, no_face_s, unseen_s)
        constants_s = np.where(continued, config.evidence_time_constant_s, constants_s)
        belief = drift(before, dt_s, constants_s, config)
    if shows_face.any():
        measured = measure(belief, evidence_means, evidence_variances, interval_s, config)
        # A tentative track may be clutter: its evidence must never shrink an obstacle.
        bound = np.where(tracks.confirmed, measured.bound, belief.bound)
        counts = shows_face
        if dt_s <= 0.0:
            # A second measurement at the same stamp may only lower the bound.
            counts = shows_face & ((stamps != stamp_s) | (bound < belief.bound))
        belief = AwarenessBelief(
            np.where(counts, measured.mean, belief.mean),
            np.where(counts, measured.variance, belief.variance),
            np.where(counts, bound, belief.bound),
        )
        stamps = np.where(shows_face, stamp_s, stamps)
    if ambiguous.any():
        fresh = forget(belief, config)
        belief = AwarenessBelief(
            np.where(ambiguous, fresh.mean, belief.mean),
            np.where(ambiguous, fresh.variance, belief.variance),
            np.where(ambiguous, fresh.bound, belief.bound),
        )
        stamps = np.where(ambiguous, np.nan, stamps)
    return tracks.replaced(
        awareness_means=np.asarray(belief.mean),
        awareness_variances=np.asarray(belief.variance),
        awareness_bounds=np.asarray(belief.bound),
        evidence_stamps_s=stamps,
    )
