"""The judges of tracks, on cases whose scores are known by counting."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tracking import GATE_M, TrackedFrame, judge

pytest.importorskip("motmetrics", reason="see benchmarks/tracking/requirements.txt")
pytest.importorskip("trackeval", reason="see benchmarks/tracking/requirements.txt")

FRAMES = 20
TRUTH = np.zeros((FRAMES, 2, 4))
TRUTH[:, 1, 0] = 5.0


def frames(ids: list[list[int]], x_m: list[list[float]]) -> list[TrackedFrame]:
    return [
        TrackedFrame(np.array(i, dtype=np.int64), np.array([[x, 0.0] for x in xs]).reshape(-1, 2))
        for i, xs in zip(ids, x_m, strict=True)
    ]


def test_perfect_tracks_score_one() -> None:
    score = judge(TRUTH, frames([[7, 3]] * FRAMES, [[0.0, 5.0]] * FRAMES))
    assert (score.mota, score.idf1, score.hota, score.switches) == (1.0, 1.0, 1.0, 0.0)


def test_a_swap_half_way_costs_two_switches_and_half_the_identities() -> None:
    half = FRAMES // 2
    score = judge(TRUTH, frames([[1, 2]] * half + [[2, 1]] * half, [[0.0, 5.0]] * FRAMES))
    assert score.switches == 2.0
    assert score.mota == pytest.approx(1.0 - 2.0 / (2 * FRAMES))
    assert score.idf1 == pytest.approx(0.5)


def test_the_gate_is_one_metre() -> None:
    inside = judge(TRUTH, frames([[1, 2]] * FRAMES, [[0.99 * GATE_M, 5.0]] * FRAMES))
    outside = judge(TRUTH, frames([[1, 2]] * FRAMES, [[1.01 * GATE_M, 5.0]] * FRAMES))
    assert inside.mota == 1.0
    assert inside.hota > outside.hota
    # One missed person and one false track in every frame.
    assert outside.mota == 0.0
    assert outside.misses == outside.false_positives == FRAMES
