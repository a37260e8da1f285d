"""Figures of the benchmark as text and as a baseline, and their targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from awarenav.baseline import MeasuredValue

from ._judges import TrackingScores

#: Targets of our tracker with 20 people: least MOTA, least IDF1, most switches (seed means).
TARGETS = {"open": (0.985, 0.95, 4.0), "occluded": (0.94, 0.72, 35.0)}
#: Most processor time of our tracker relative to a peer's, the making of observations or detections
#: included: (people, peer) -> ratio.
COST_TARGETS = {
    (20, "norfair"): 1.0,  # here most of the time does not depend on the number of people
    (20, "stonesoup-gnn"): 0.05,
    (100, "norfair"): 0.5,
    (300, "norfair"): 0.5,
}
#: Least share of frames whose NEES lies in its 95 % band. Frames of one run are correlated, so the
#: share scatters around 0.95.
INSIDE_TARGET = 0.85

SCORE_HEADER = (
    f"{'set':9s}{'people':>6s}  {'tracker':15s}{'MOTA':>14s}{'IDF1':>14s}{'switches':>14s}"
    f"{'HOTA':>7s}{'misses':>8s}{'false':>7s}"
)


def score_line(name: str, people: int, tracker: str, scores: Sequence[TrackingScores]) -> str:
    """Return one tracker's row: mean over seeds ± standard deviation."""

    def mean(field: str) -> float:
        return float(np.mean([getattr(score, field) for score in scores]))

    def spread(field: str) -> float:
        return float(np.std([getattr(score, field) for score in scores]))

    return (
        f"{name:9s}{people:6d}  {tracker:15s}"
        f"{mean('mota'):8.3f} ±{spread('mota'):.3f}{mean('idf1'):8.3f} ±{spread('idf1'):.3f}"
        f"{mean('switches'):8.1f} ±{spread('switches'):<4.1f}{mean('hota'):7.3f}"
        f"{mean('misses'):8.0f}{mean('false_positives'):7.0f}"
    )


def score_metrics(
    name: str, people: int, tracker: str, scores: Sequence[TrackingScores]
) -> list[MeasuredValue]:
    """Return a tracker's figures for the baseline."""
    key = f"{name}_{people}_{tracker}"
    mean = {
        field: float(np.mean([asdict(s)[field] for s in scores])) for field in asdict(scores[0])
    }
    return [
        MeasuredValue(f"{key}_mota", mean["mota"], "1", "higher", 0.005),
        MeasuredValue(f"{key}_idf1", mean["idf1"], "1", "higher", 0.03),
        MeasuredValue(f"{key}_hota", mean["hota"], "1", "higher", 0.03),
        # Switches are rare, so their number scatters.
        MeasuredValue(f"{key}_switches", mean["switches"], "switches/run", "lower", 0.5),
    ]


def missed_scores(
    name: str, people: int, tracker: str, scores: Sequence[TrackingScores]
) -> list[str]:
    """Return the targets that our tracker misses in one set, one line each."""
    if tracker != "ours" or people != 20 or name not in TARGETS:
        return []
    mota, idf1, switches = TARGETS[name]
    got = [float(np.mean([getattr(s, f) for s in scores])) for f in ("mota", "idf1", "switches")]
    missed = []
    if got[0] < mota:
        missed.append(f"{name}: MOTA {got[0]:.3f}, at least {mota:g} wanted")
    if got[1] < idf1:
        missed.append(f"{name}: IDF1 {got[1]:.3f}, at least {idf1:g} wanted")
    if got[2] > switches:
        missed.append(f"{name}: {got[2]:.1f} switches, at most {switches:g} wanted")
    return missed


def cost_metrics(people: int, cost_ms: Mapping[str, float]) -> list[MeasuredValue]:
    """Return ratios of our processor time to each peer's; bare times depend on the computer."""
    return [
        MeasuredValue(
            f"cost_{people}_with_input_over_{peer}", cost_ms["ours"] / value, "x", "lower", 0.4
        )
        for peer, value in cost_ms.items()
        if peer != "ours" and "ours" in cost_ms
    ]


def missed_costs(people: int, cost_ms: Mapping[str, float]) -> list[str]:
    """Return the cost targets that our tracker misses, one line each."""
    missed = []
    for (crowd, peer), most in COST_TARGETS.items():
        if crowd == people and peer in cost_ms and "ours" in cost_ms:
            ratio = cost_ms["ours"] / cost_ms[peer]
            if ratio > most:
                missed.append(
                    f"cost at {people} people: {ratio:.2f} of {peer}'s, at most {most:g} wanted"
                )
    return missed
