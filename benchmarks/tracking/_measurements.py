"""Simulated detections of the walkers: noise, misses, clutter and spells out of sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._walkers import FloatArray, WalkerSettings, walk


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
        clutter_per_m2: false reports per frame and square metre.
        miss_probability: chance that a visible person is not reported.
    """

    stamps_s: FloatArray
    truth: FloatArray
    visible: NDArray[np.bool_]
    measured_m: tuple[FloatArray, ...]
    noise_std_m: float
    clutter_per_m2: float
    miss_probability: float


def record(
    people: int,
    frames: int,
    rng: np.random.Generator,
    sensor: SensorSettings = OPEN,
    walkers: WalkerSettings | None = None,
) -> SimulatedRecording:
    """Simulate a crowd and measure it."""
    walkers = walkers or WalkerSettings()
    stamps_s = np.arange(frames) / sensor.rate_hz
    truth = walk(people, stamps_s, rng, walkers)
    visible = visible_spells(people, stamps_s, sensor, rng)
    side_m = walkers.side_m(people)
    measured = []
    for frame in range(frames):
        shown = visible[frame] & (rng.random(people) >= sensor.miss_probability)
        people_m = truth[frame, shown, :2] + rng.normal(
            0.0, sensor.noise_std_m, (int(shown.sum()), 2)
        )
        count = int(rng.poisson(sensor.clutter_per_m2 * side_m**2))
        clutter_m = rng.uniform(0.0, side_m, (count, 2))
        measured.append(rng.permutation(np.concatenate([people_m, clutter_m])))
    return SimulatedRecording(
        stamps_s,
        truth,
        visible,
        tuple(measured),
        sensor.noise_std_m,
        sensor.clutter_per_m2,
        sensor.miss_probability,
    )


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
