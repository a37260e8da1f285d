"""Update of every track's awareness with one frame."""

from __future__ import annotations

import numpy as np

from perception.arrays import FloatArray

from ._config import AwarenessFilterConfig
from ._table import BoolArray, TrackTable
from .awareness_filter import AwarenessBelief, drift, drift_unseen, forget, measure


def belief_of(tracks: TrackTable) -> AwarenessBelief:
    """Return the awareness of every track as a belief."""
    return AwarenessBelief(
        tracks.awareness_means, tracks.awareness_variances, tracks.awareness_bounds
    )


def update_awareness(
    tracks: TrackTable,
    previous_stamp_s: float,
    stamp_s: float,
    interval_s: float | FloatArray,
    period_s: float | FloatArray,
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
        interval_s: > 0, time that the frame stands for; one number or (N,).
        period_s: usual time between frames, before this one; one number or (N,).
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
        no_face_s = max(config.no_face_time_constant_s, config.memory_s)
        # Two faces count for the time between them, missed frames included, unless it is long.
        continued = shows_face & (stamp_s - stamps <= config.max_evidence_gap_s)
        faceless = observed & ~shows_face
        constants_s = np.where(continued, config.evidence_time_constant_s, no_face_s)
        known = drift(before, dt_s, constants_s, config)
        unknown = drift_unseen(before, previous_stamp_s, stamp_s, stamps, period_s, config)
        belief = _choose(continued | faceless, known, unknown)
        # A person without a face has not just been missed: that ends the grace.
        stamps = np.where(faceless, np.nan, stamps)
    if shows_face.any():
        measured = measure(belief, evidence_means, evidence_variances, interval_s, config)
        # A tentative track may be clutter: its evidence must never shrink an obstacle.
        bound = np.where(tracks.confirmed, measured.bound, belief.bound)
        counts = shows_face
        if dt_s <= 0.0:
            # A second measurement at the same stamp may only lower the bound.
            counts = shows_face & ((stamps != stamp_s) | (bound < belief.bound))
        measured = AwarenessBelief(measured.mean, measured.variance, bound)
        belief = _choose(counts, measured, belief)
        stamps = np.where(shows_face, stamp_s, stamps)
    if ambiguous.any():
        belief = _choose(ambiguous, forget(belief, config), belief)
        stamps = np.where(ambiguous, np.nan, stamps)
    return tracks.replaced(
        awareness_means=np.asarray(belief.mean),
        awareness_variances=np.asarray(belief.variance),
        awareness_bounds=np.asarray(belief.bound),
        evidence_stamps_s=stamps,
    )


def forgotten(
    tracks: TrackTable, ambiguous: BoolArray, config: AwarenessFilterConfig
) -> TrackTable:
    """Return the tracks with the prior awareness where a match was ``ambiguous`` (N,)."""
    if not ambiguous.any():
        return tracks
    before = belief_of(tracks)
    belief = _choose(ambiguous, forget(before, config), before)
    return tracks.replaced(
        awareness_means=np.asarray(belief.mean),
        awareness_variances=np.asarray(belief.variance),
        awareness_bounds=np.asarray(belief.bound),
        evidence_stamps_s=np.where(ambiguous, np.nan, tracks.evidence_stamps_s),
    )


def _choose(mask: BoolArray, first: AwarenessBelief, second: AwarenessBelief) -> AwarenessBelief:
    """Return the first belief where ``mask`` (N,) is True, the second elsewhere."""
    return AwarenessBelief(
        np.where(mask, first.mean, second.mean),
        np.where(mask, first.variance, second.variance),
        np.where(mask, first.bound, second.bound),
    )
