"""The simulated walkers and their measurements, on which trackers are compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tracking import (
    OCCLUDED,
    OPEN,
    WalkerSettings,
    record,
    walk,
)

STAMPS_S = np.arange(400) / 20.0


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return walk(20, STAMPS_S, np.random.default_rng(3))


def test_people_walk_stand_and_stay_inside_and_apart(truth: np.ndarray) -> None:
    side_m = WalkerSettings().side_m(20)
    speed = np.hypot(truth[..., 2], truth[..., 3])
    assert truth[..., :2].min() > -0.5
    assert truth[..., :2].max() < side_m + 0.5
    assert speed.max() < 2.6
    assert 0.4 < np.median(speed) < 1.4
    assert (speed < 0.1).mean() > 0.02
    offset = truth[:, :, None, :2] - truth[:, None, :, :2]
    distance = np.hypot(offset[..., 0], offset[..., 1]) + 9.0 * np.eye(20)
    # People drawn at random would have a neighbour within 0.3 m in 7 % of cases.
    assert (distance.min(axis=2) < 0.3).mean() < 0.03


def test_misses_and_clutter_are_as_frequent_as_set() -> None:
    recording = record(20, 600, np.random.default_rng(1), OPEN)
    area_m2 = WalkerSettings().side_m(20) ** 2
    counts = np.array([len(measured) for measured in recording.measured_m])
    variance = 20 * 0.9 * 0.1 + OPEN.clutter_per_m2 * area_m2
    expected = 20 * 0.9 + OPEN.clutter_per_m2 * area_m2
    assert abs(counts.mean() - expected) < 4.0 * np.sqrt(variance / len(counts))
    assert recording.visible.all()


def test_nobody_is_measured_while_out_of_sight() -> None:
    sensor = replace(OCCLUDED, miss_probability=0.0, clutter_per_m2=0.0)
    recording = record(10, 300, np.random.default_rng(6), sensor)
    assert [len(m) for m in recording.measured_m] == recording.visible.sum(axis=1).tolist()
