"""The shipped workers as parameters of tests, and how far a sole slides."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests.actors.body import worker_names

_ALWAYS = ("amina",)
#: Their files do not change, so one worker stands for all in every run.
LOOKS = [
    pytest.param(name, marks=() if name in _ALWAYS else pytest.mark.full) for name in worker_names()
]


def slip_m(shoe: np.ndarray, touching_m: float = 0.004) -> float:
    """Return the longest slide of any point of a sole (N, V, 3) while it touches the floor."""
    worst, touched, start = 0.0, np.zeros(shoe.shape[1], dtype=bool), shoe[0, :, :2].copy()
    for frame in shoe:
        touches = frame[:, 2] < touching_m
        start[touches & ~touched] = frame[touches & ~touched, :2]
        moved = np.linalg.norm(frame[:, :2] - start, axis=1)[touches]
        worst = max(worst, float(moved.max(initial=0.0)))
        touched = touches
    return worst
