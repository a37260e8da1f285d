"""Scores of tracks: MOTA, IDF1 and switches by motmetrics, HOTA by TrackEval, with one gate."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from ._walkers import FloatArray

#: Largest distance between a person and a track that counts as that person.
GATE_M = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """Tracks of one frame: ids (K,) and positions (K, 2) in metres."""

    ids: NDArray[np.int64]
    positions_m: FloatArray


@dataclass(frozen=True, slots=True)
class TrackingScores:
    """Figures of one whole run.

    Attributes:
        mota: multiple object tracking accuracy (motmetrics).
        idf1: share of frames with the right identity (motmetrics).
        switches: identity switches (motmetrics).
        misses: people without a track, summed over frames (motmetrics).
        false_positives: tracks without a person, summed over frames (motmetrics).
        hota: higher order tracking accuracy, mean over its thresholds (TrackEval).
    """

    mota: float
    idf1: float
    switches: float
    misses: float
    false_positives: float
    hota: float


def judge(truth: FloatArray, tracked: Sequence[TrackedFrame]) -> TrackingScores:
    """Judge tracks against truth (T, N, ≥ 2); every person counts in every frame, seen or not."""
    distances = [
        cdist(people[:, :2], frame.positions_m) if len(frame.ids) else np.empty((len(people), 0))
        for people, frame in zip(truth, tracked, strict=True)
    ]
    clear = _motmetrics(truth, tracked, distances)
    return TrackingScores(**clear, hota=_hota(truth, tracked, distances))


def _motmetrics(
    truth: FloatArray, tracked: Sequence[TrackedFrame], distances: Sequence[FloatArray]
) -> dict[str, float]:
    import motmetrics  # noqa: PLC0415 - an optional peer

    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    people = list(range(truth.shape[1]))
    for frame, distance in zip(tracked, distances, strict=True):
        accumulator.update(
            people, frame.ids.tolist(), np.where(distance <= GATE_M, distance, np.nan)
        )
    names = ["mota", "idf1", "num_switches", "num_misses", "num_false_positives"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pandas, about motmetrics
        row = motmetrics.metrics.create().compute(accumulator, metrics=names, name="run").iloc[0]
    return {
        "mota": float(row["mota"]),
        "idf1": float(row["idf1"]),
        "switches": float(row["num_switches"]),
        "misses": float(row["num_misses"]),
        "false_positives": float(row["num_false_positives"]),
    }


def _hota(
    truth: FloatArray, tracked: Sequence[TrackedFrame], distances: Sequence[FloatArray]
) -> float:
    with contextlib.redirect_stdout(io.StringIO()):  # it prints which of its data sets are missing
        import trackeval.metrics  # noqa: PLC0415 - an optional peer

    frames, people = truth.shape[:2]
    known: dict[int, int] = {}
    ids = [
        np.array([known.setdefault(int(i), len(known)) for i in frame.ids], dtype=int)
        for frame in tracked
    ]
    data = {
        "num_timesteps": frames,
        "num_gt_ids": people,
        "num_tracker_ids": len(known),
        "num_gt_dets": frames * people,
        "num_tracker_dets": sum(len(i) for i in ids),
        "gt_ids": [np.arange(people)] * frames,
        "tracker_ids": ids,
        # As in TrackEval's own 3-D sets: 1 at distance 0, the threshold of 0.5 at the gate.
        "similarity_scores": [np.maximum(0.0, 1.0 - 0.5 * d / GATE_M) for d in distances],
    }
    with contextlib.redirect_stdout(io.StringIO()):
        hota = trackeval.metrics.HOTA().eval_sequence(data)
    return float(np.mean(hota["HOTA"]))
