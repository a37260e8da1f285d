"""Recorded people as a recording of the benchmark: simulated detections of real walks."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ._measurements import SensorSettings, SimulatedRecording, visible_spells
from ._walkers import FloatArray

_MARGIN_M = 1.0


def recordings_in(folder: Path) -> list[Path]:
    """Return the CSV files of a folder in the order of their names; none if it does not exist."""
    return sorted(folder.glob("*.csv"))


def walks_of(path: Path) -> list[FloatArray]:
    """Return (K, 3) t, x, y (s, m, m) of each person in a CSV of ``t_s, id, x_m, y_m``."""
    samples: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            samples[row["id"]].append((float(row["t_s"]), float(row["x_m"]), float(row["y_m"])))
    return [np.array(walk) for walk in samples.values()]


def record_walks(
    walks: Sequence[FloatArray], rng: np.random.Generator, sensor: SensorSettings
) -> SimulatedRecording:
    """Measure recorded people, while all of them are there, as :func:`record` measures walkers.

    Positions are interpolated linearly at the sensor's frame rate. Clutter is uniform over the
    rectangle that all walks need, and 1 m around it.
    """
    start_s, end_s = max(walk[0, 0] for walk in walks), min(walk[-1, 0] for walk in walks)
    stamps_s = np.arange(0.0, end_s - start_s, 1.0 / sensor.rate_hz)
    places = np.stack(
        [
            np.column_stack(
                [np.interp(start_s + stamps_s, walk[:, 0], walk[:, axis]) for axis in (1, 2)]
            )
            for walk in walks
        ],
        axis=1,
    )
    people = len(walks)
    visible = visible_spells(people, stamps_s, sensor, rng)
    low_m = places.reshape(-1, 2).min(axis=0) - _MARGIN_M
    high_m = places.reshape(-1, 2).max(axis=0) + _MARGIN_M
    area_m2 = float(np.prod(high_m - low_m))
    measured = []
    for frame, now in enumerate(places):
        shown = visible[frame] & (rng.random(people) >= sensor.miss_probability)
        seen_m = now[shown] + rng.normal(0.0, sensor.noise_std_m, (int(shown.sum()), 2))
        count = int(rng.poisson(sensor.clutter_per_m2 * area_m2))
        measured.append(
            rng.permutation(np.concatenate([seen_m, rng.uniform(low_m, high_m, (count, 2))]))
        )
    return SimulatedRecording(
        stamps_s,
        np.concatenate([places, np.zeros_like(places)], axis=2),  # speeds are not judged
        visible,
        tuple(measured),
        sensor.noise_std_m,
        sensor.clutter_per_m2,
        sensor.miss_probability,
    )
