"""The simulated walkers on which trackers are compared, and the prediction on people."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from paths import ROOT

from benchmarks.tracking import OCCLUDED, OPEN, record, side_m, walk
from benchmarks.tracking._prediction import (
    CONSTANT_VELOCITY,
    figures,
    judge_model,
    recorded_walks,
    simulated_walks,
    track,
)
from tracking.prediction import FITTED, REGION_SHARE

STAMPS_S = np.arange(400) / 20.0


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return walk(20, STAMPS_S, np.random.default_rng(3))


def test_people_walk_stand_and_stay_inside_and_apart(truth: np.ndarray) -> None:
    speed = np.hypot(truth[..., 2], truth[..., 3])
    assert truth[..., :2].min() > -0.5
    assert truth[..., :2].max() < side_m(20) + 0.5
    assert speed.max() < 2.6
    assert 0.4 < np.median(speed) < 1.4
    assert (speed < 0.1).mean() > 0.02
    offset = truth[:, :, None, :2] - truth[:, None, :, :2]
    distance = np.hypot(offset[..., 0], offset[..., 1]) + 9.0 * np.eye(20)
    # People drawn at random would have a neighbour within 0.3 m in 7 % of cases.
    assert (distance.min(axis=2) < 0.3).mean() < 0.03


def test_misses_and_clutter_are_as_frequent_as_set() -> None:
    recording = record(20, 600, np.random.default_rng(1), OPEN)
    area_m2 = side_m(20) ** 2
    counts = np.array([len(measured) for measured in recording.measured_m])
    variance = 20 * 0.9 * 0.1 + OPEN.clutter_per_m2 * area_m2
    expected = 20 * 0.9 + OPEN.clutter_per_m2 * area_m2
    assert abs(counts.mean() - expected) < 4.0 * np.sqrt(variance / len(counts))
    assert recording.visible.all()


def test_nobody_is_measured_while_out_of_sight() -> None:
    sensor = replace(OCCLUDED, miss_probability=0.0, clutter_per_m2=0.0)
    recording = record(10, 300, np.random.default_rng(6), sensor)
    assert [len(m) for m in recording.measured_m] == recording.visible.sum(axis=1).tolist()


# --- prediction -----------------------------------------------------------------------------------


RECORDINGS = ROOT.parent / "shared" / "data"


def test_the_covariance_holds_on_simulated_people() -> None:
    """Two crowds that neither the fit nor the benchmark uses, at 10 Hz."""
    walkers = track(simulated_walks(10.0, 0.05, range(200, 202)), 0.05)
    found = judge_model(FITTED, walkers)
    assert found.holds.all(), found
    straight = judge_model(CONSTANT_VELOCITY, walkers)
    np.testing.assert_array_equal(found.error_m, straight.error_m)
    # Constant velocity alone does not hold: this is what the model is for.
    assert straight.coverage[-1] < REGION_SHARE - 0.1
    assert straight.nees[-1] > 1.5


@pytest.mark.parametrize(("rate_hz", "noise_m"), [(10.0, 0.15), (30.0, 0.05)])
def test_the_covariance_holds_on_recorded_people(rate_hz: float, noise_m: float) -> None:
    walks = recorded_walks(RECORDINGS, rate_hz, noise_m, seed=7)
    if not walks:
        pytest.skip(f"needs recorded people, CSV files in {RECORDINGS}")
    found = judge_model(FITTED, track(walks, noise_m))
    # By chance, one measurement of these 56 people differs from another by 1 %.
    assert (np.abs(found.coverage - REGION_SHARE) < 0.05).all(), found
    assert ((found.nees > 0.8) & (found.nees < 1.3)).all(), found


def test_figures_of_a_normal_distribution() -> None:
    rng = np.random.default_rng(0)
    root = np.array([[0.5, 0.0], [0.2, 0.1]])
    later = rng.normal(size=(20_000, 3, 2)) @ root.T
    later[::2, 2] = np.nan
    covariances = np.broadcast_to(root @ root.T, (20_000, 3, 2, 2))
    found = figures(np.zeros_like(later), covariances, later)
    np.testing.assert_allclose(found.coverage, REGION_SHARE, atol=0.01)
    np.testing.assert_allclose(found.nees, 1.0, atol=0.02)
    half = figures(np.zeros_like(later), 0.25 * covariances, later)
    np.testing.assert_allclose(half.nees, 4.0 * found.nees)
    assert not half.holds.any()
