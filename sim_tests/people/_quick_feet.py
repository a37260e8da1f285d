"""How far a foot may go round the standing one in the time that its swing has."""

from __future__ import annotations

from typing import Final

import numpy as np

from perception.arrays import FloatArray

# A foot that has no time for the whole way round passes nearer.
_QUICKEST_FOOT_MPS: Final = 9.0


def unhurried(
    place_m: FloatArray,
    aside_m: FloatArray,
    direction: tuple[FloatArray, FloatArray],
    times_s: FloatArray,
) -> float:
    """Share of a way round, in [0, 1], that keeps a foot within its quickest.

    Args:
        place_m: (N, 2) of the foot without the way round.
        aside_m: (N,) how far the way round leads aside.
        direction: (N,) x and (N,) y of the unit vectors that lead there.
        times_s: (N,) increasing.
    """
    dt_s = np.diff(times_s)[:, None]
    straight = np.diff(place_m, axis=0) / dt_s
    way = np.diff(aside_m[:, None] * np.column_stack(direction), axis=0) / dt_s
    # The largest share s with |straight + s way| at most the quickest, in every interval.
    square, mixed = (way**2).sum(axis=1), (way * straight).sum(axis=1)
    spare = _QUICKEST_FOOT_MPS**2 - (straight**2).sum(axis=1)
    moves = square > 1e-12
    root = np.sqrt(np.maximum(mixed[moves] ** 2 + square[moves] * spare[moves], 0.0))
    return float(np.clip(((root - mixed[moves]) / square[moves]).min(initial=1.0), 0.0, 1.0))
