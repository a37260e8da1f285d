"""The prediction on people who were not fitted, and the parts of its benchmark."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from paths import ROOT

from benchmarks.tracking._prediction import by_earlier_formula
from benchmarks.tracking._prediction_fit import figures, fit, judge_model
from benchmarks.tracking._prediction_sets import (
    HORIZONS_S,
    TrackedInstants,
    recorded_walks,
    simulated_walks,
    track,
)
from tracking import TrackerConfig
from tracking.prediction import FITTED, REGION_SHARE, predict_states

RECORDINGS = ROOT.parent / "shared" / "data"


@pytest.fixture(scope="module")
def walkers() -> TrackedInstants:
    """Two crowds that neither the fit nor the benchmark uses, at 10 Hz."""
    return track(simulated_walks(10.0, 0.05, range(200, 202)), TrackerConfig())


def test_the_covariance_holds_on_simulated_people(walkers: TrackedInstants) -> None:
    found = judge_model(FITTED, walkers)
    assert found.holds.all(), found
    straight = by_earlier_formula(walkers, 0.0)
    np.testing.assert_array_equal(found.error_m, straight.error_m)
    # Constant velocity alone does not hold: this is what the model is for.
    assert straight.coverage[-1] < REGION_SHARE - 0.1
    assert straight.nees[-1] > 1.5


@pytest.mark.parametrize(("rate_hz", "noise_m"), [(10.0, 0.15), (30.0, 0.05)])
def test_the_covariance_holds_on_recorded_people(rate_hz: float, noise_m: float) -> None:
    walks = recorded_walks(RECORDINGS, rate_hz, noise_m, seed=7)
    if not walks:
        pytest.skip(f"needs recorded people, CSV files in {RECORDINGS}")
    found = judge_model(FITTED, track(walks, TrackerConfig()))
    # By chance, one measurement of these 56 people differs from another by 1 %.
    assert (np.abs(found.coverage - REGION_SHARE) < 0.05).all(), found
    assert ((found.nees > 0.8) & (found.nees < 1.3)).all(), found


def test_a_fit_finds_the_model_that_made_the_people(walkers: TrackedInstants) -> None:
    """Places drawn from a model's own covariance: another start must end as consistent."""
    rng = np.random.default_rng(8)
    places = walkers.states[:, None, :2] + HORIZONS_S[:, None] * walkers.states[:, None, 2:]
    model = FITTED.model_copy(update={"change_mps": 0.5, "sway_s": 0.1})
    found = judge_model(model, walkers)
    assert found.coverage[-1] > 0.93
    spread = predict_states(walkers.states, walkers.covariances, HORIZONS_S, model)
    roots = np.linalg.cholesky(spread.covariances_odom_m2)
    drawn = places + (roots @ rng.normal(size=(*places.shape, 1)))[..., 0]
    made = TrackedInstants(
        walkers.groups, walkers.walks, walkers.stamps_s, walkers.states, walkers.covariances, drawn
    ).take(slice(None, None, 4))
    before, after = judge_model(FITTED, made), judge_model(fit({"made": made}, FITTED), made)
    assert before.nees.max() > 1.25
    assert np.abs(after.coverage - REGION_SHARE).max() < 0.02
    assert np.abs(np.log(after.nees)).max() < 0.12


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


def test_the_same_seed_gives_the_same_measurements(tmp_path: Path) -> None:
    one, other = (simulated_walks(10.0, 0.1, [3])[0] for _ in range(2))
    np.testing.assert_array_equal(one.measured_m, other.measured_m)
    assert np.isnan(one.places_m(np.array([1e3]))).all()
    assert recorded_walks(tmp_path, 10.0, 0.1, 0) == []
