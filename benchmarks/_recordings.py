"""Recorded people: CSV files of ``t_s, id, x_m, y_m``, metres on the floor."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from perception.arrays import FloatArray


def recordings_in(folder: Path) -> list[Path]:
    """Return the CSV files of a folder in the order of their names; none if it does not exist."""
    return sorted(folder.glob("*.csv"))


def walks_of(path: Path) -> list[FloatArray]:
    """Return (K, 3) t, x, y (s, m, m) of each person in a file."""
    samples: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            samples[row["id"]].append((float(row["t_s"]), float(row["x_m"]), float(row["y_m"])))
    return [np.array(walk) for walk in samples.values()]


def places_together(walks: Sequence[FloatArray], rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Return stamps (T,) from 0 on and places (T, N, 2) of people, while all of them are there.

    Places are interpolated linearly.
    """
    start_s, end_s = max(walk[0, 0] for walk in walks), min(walk[-1, 0] for walk in walks)
    stamps_s = np.arange(0.0, end_s - start_s, 1.0 / rate_hz)
    places = [
        np.column_stack(
            [np.interp(start_s + stamps_s, walk[:, 0], walk[:, axis]) for axis in (1, 2)]
        )
        for walk in walks
    ]
    return stamps_s, np.stack(places, axis=1)
