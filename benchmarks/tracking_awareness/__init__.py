"""Awareness over time on simulated attention: delay, false awareness and coverage."""

from __future__ import annotations

from ._attention import Attention, autoregressive, directions, simulate
from ._camera import Measured, measure, track
from ._cli import judge, main, make_set, missed_targets
from ._filters import HistogramFilter, LogitGaussian, PlainLogit, Smoothed, hold_latest
from ._hard import HardSet, make_hard_set
from ._scores import (
    FALSE_SHARE,
    AwarenessScores,
    onset_times_s,
    release_times_s,
    score,
    threshold_for,
    time_unseen_s,
)

__all__ = [
    "FALSE_SHARE",
    "Attention",
    "AwarenessScores",
    "HardSet",
    "HistogramFilter",
    "LogitGaussian",
    "Measured",
    "PlainLogit",
    "Smoothed",
    "autoregressive",
    "directions",
    "hold_latest",
    "judge",
    "main",
    "make_hard_set",
    "make_set",
    "measure",
    "missed_targets",
    "onset_times_s",
    "release_times_s",
    "score",
    "simulate",
    "threshold_for",
    "time_unseen_s",
    "track",
]
