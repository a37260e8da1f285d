"""The prediction on people who were not fitted, and the figures of its benchmark."""

from __future__ import annotations

import numpy as np
import pytest
from paths import ROOT

from benchmarks.tracking._prediction import (
    CONSTANT_VELOCITY,
    figures,
    judge_model,
    recorded_walks,
    simulated_walks,
    track,
)
from tracking.prediction import FITTED, REGION_SHARE

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
