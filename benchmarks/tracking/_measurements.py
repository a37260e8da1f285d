"""Simulated detections of walkers and of recorded people: noise, misses, clutter, spells unseen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._recordings import places_together
from ._walkers import FloatArray, side_m, walk


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """Settings of the sensor; the defaults are those of the benchmark.

    Attributes:
        rate_hz: frames per second.
        noise_std_m: of a measured position, on each axis.
        miss_probability: chance that a visible person is not reported in a frame.
        clutter_per_m2: false reports per frame and square metre (Poisson, uniform over the hall).
        seen_mean_s: mean time between two spells out of sight; None for no such spells.
        unseen_s: shortest and longest spell.
    """

    rate_hz: float = 20.0
    noise_std_m: float = 0.15
    miss_probability: float = 0.1
    clutter_per_m2: float = 0.01
    seen_mean_s: float | None = None
    unseen_s: tuple[float, float] = (0.5, 1.0)


# Clutter lies up to this far around recorded people.
_MARGIN_M = 1.0

OPEN = SensorSettings()
OCCLUDED = SensorSettings(seen_mean_s=2.5)


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedRecording:
    """Truth and measurements of one run, the same for every tracker.

    Attributes:
        stamps_s: (T,).
        truth: (T, N, 4) x, y (m), vx, vy (m/s).
        visible: (T, N) False during a spell out of sight.
        measured_m: T arrays (M, 2), in random order.
        noise_std_m: of a measured position, on each axis.
    """

    stamps_s: FloatArray
    truth: FloatArray
    visible: NDArray[np.bool_]
    measured_m: tuple[FloatArray, ...]
    noise_std_m: float


def record(
    people: int, frames: int, rng: np.random.Generator, sensor: SensorSettings = OPEN
) -> SimulatedRecording:
    """Simulate a crowd and measure it; clutter is uniform over the hall."""
    stamps_s = np.arange(frames) / sensor.rate_hz
    truth = walk(people, stamps_s, rng)
    return _measured(stamps_s, truth, np.zeros(2), np.full(2, side_m(people)), rng, sensor)


def _measured(
    stamps_s: FloatArray,
    truth: FloatArray,
    low_m: FloatArray,
    high_m: FloatArray,
    rng: np.random.Generator,
    sensor: SensorSettings,
) -> SimulatedRecording:
    """Measure people (T, N, 4), with clutter in the rectangle from ``low_m`` to ``high_m``."""
    people = truth.shape[1]
    visible = visible_spells(people, stamps_s, sensor, rng)
    area_m2 = float(np.prod(high_m - low_m))
    measured = []
    for frame, now_m in enumerate(truth[:, :, :2]):
        shown = visible[frame] & (rng.random(people) >= sensor.miss_probability)
        people_m = now_m[shown] + rng.normal(0.0, sensor.noise_std_m, (int(shown.sum()), 2))
        count = int(rng.poisson(sensor.clutter_per_m2 * area_m2))
        clutter_m = rng.uniform(low_m, high_m, (count, 2))
        measured.append(rng.permutation(np.concatenate([people_m, clutter_m])))
    return SimulatedRecording(stamps_s, truth, visible, tuple(measured), sensor.noise_std_m)


def visible_spells(
    people: int, stamps_s: FloatArray, sensor: SensorSettings, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return (T, N) visibility with spells out of sight, drawn independently for each person."""
    visible = np.ones((len(stamps_s), people), dtype=bool)
    if sensor.seen_mean_s is None:
        return visible
    for person in range(people):
        begin_s = rng.exponential(sensor.seen_mean_s)
        while begin_s < stamps_s[-1]:
            end_s = begin_s + rng.uniform(*sensor.unseen_s)
            visible[(stamps_s >= begin_s) & (stamps_s < end_s), person] = False
            begin_s = end_s + rng.exponential(sensor.seen_mean_s)
    return visible


def record_walks(
    walks: Sequence[FloatArray], rng: np.random.Generator, sensor: SensorSettings
) -> SimulatedRecording:
    """Measure recorded people, while all of them are there, as :func:`record` measures walkers.

    Positions are interpolated linearly at the sensor's frame rate. Clutter is uniform over the
    rectangle that all walks need, and 1 m around it.
    """
    stamps_s, places = places_together(walks, sensor.rate_hz)
    low_m = places.reshape(-1, 2).min(axis=0) - _MARGIN_M
    high_m = places.reshape(-1, 2).max(axis=0) + _MARGIN_M
    truth = np.concatenate([places, np.zeros_like(places)], axis=2)  # speeds are not judged
    return _measured(stamps_s, truth, low_m, high_m, rng, sensor)
