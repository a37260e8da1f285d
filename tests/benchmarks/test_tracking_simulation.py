"""The simulated walkers and their measurements, on which trackers are compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.tracking import (
    OCCLUDED,
    OPEN,
    SimulatedRecording,
    WalkerSettings,
    record,
    walk,
)

STAMPS_S = np.arange(400) / 20.0


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return walk(20, STAMPS_S, np.random.default_rng(3))


@pytest.fixture(scope="module")
def occluded() -> SimulatedRecording:
    return record(20, 600, np.random.default_rng(4), OCCLUDED)


def test_the_same_seed_gives_the_same_people(truth: np.ndarray) -> None:
    assert np.array_equal(truth, walk(20, STAMPS_S, np.random.default_rng(3)))
    assert not np.array_equal(truth, walk(20, STAMPS_S, np.random.default_rng(5)))


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


def test_noise_is_as_large_as_set_and_measurements_come_in_random_order() -> None:
    sensor = replace(OPEN, miss_probability=0.0, clutter_per_m2=0.0, noise_std_m=0.01)
    recording = record(5, 300, np.random.default_rng(2), sensor)
    first, errors = [], []
    for people, measured in zip(recording.truth[..., :2], recording.measured_m, strict=True):
        offset = measured[:, None] - people[None]
        nearest = np.hypot(offset[..., 0], offset[..., 1]).argmin(axis=1)
        errors.append(measured - people[nearest])
        first.append(int(nearest[0]))
    assert np.std(np.concatenate(errors)) == pytest.approx(0.01, rel=0.05)
    assert len(set(first)) == 5


def test_spells_out_of_sight_last_as_long_as_set(occluded: SimulatedRecording) -> None:
    lengths = []
    for shown in occluded.visible.T:
        edges = np.flatnonzero(np.diff(shown.astype(int)))
        begins, ends = edges[shown[edges]], edges[~shown[edges]]
        lengths += [int(ends[ends > begin][0] - begin) for begin in begins if (ends > begin).any()]
    assert len(lengths) > 50
    # Rarely, two spells follow each other within a frame and look like one.
    assert np.percentile(lengths, 95) <= 20
    assert min(lengths) >= 10


def test_nobody_is_measured_while_out_of_sight() -> None:
    sensor = replace(OCCLUDED, miss_probability=0.0, clutter_per_m2=0.0)
    recording = record(10, 300, np.random.default_rng(6), sensor)
    assert [len(m) for m in recording.measured_m] == recording.visible.sum(axis=1).tolist()
