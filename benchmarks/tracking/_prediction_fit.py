"""Fit of the prediction model: a covariance that holds on recorded and on simulated people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.optimize import minimize

from tracking.prediction import REGION_SHARE, REGION_SIGMAS, PredictionModel, predict_states

from ._prediction_sets import HORIZONS_S, TrackedInstants
from ._walkers import FloatArray

#: Wanted: the share of people inside the region, and the range of NEES/2.
COVERAGE_BAND: Final = (REGION_SHARE - 0.04, REGION_SHARE + 0.04)
NEES_BAND: Final = (0.8, 1.3)
#: Settings that are fitted.
FITTED_SETTINGS: Final = (
    "lag_per_s2",
    "response_s",
    "change_mps",
    "slow_change_mps",
    "slow_below_mps",
    "sway_s",
)
# Weights in the loss: NEES outside ±10 %, and the mean log density, which decides among equals.
_NEES_SLACK, _DENSITY_WEIGHT = 0.1, 0.1
_EVALUATIONS: Final = 260


class Figures(NamedTuple):
    """Figures of a prediction, one per horizon.

    Attributes:
        coverage: (T,) share of people inside the region of two standard deviations.
        nees: (T,) mean normalised squared error over its dimension; 1 if consistent.
        surprise: (T,) mean of half the squared error and half of ln det; lower is better.
        error_m: (T,) mean distance.
    """

    coverage: FloatArray
    nees: FloatArray
    surprise: FloatArray
    error_m: FloatArray

    @property
    def holds(self) -> Any:
        """(T,) whether coverage and NEES are in their bands."""
        low, high = COVERAGE_BAND
        least, most = NEES_BAND
        covered = (self.coverage >= low) & (self.coverage <= high)
        return covered & (self.nees >= least) & (self.nees <= most)


def figures(means_m: FloatArray, covariances_m2: FloatArray, later_m: FloatArray) -> Figures:
    """Return the figures of predictions (K, T, 2) and (K, T, 2, 2) against places, NaN left out."""
    error = later_m - means_m
    xx, xy, yy = covariances_m2[..., 0, 0], covariances_m2[..., 0, 1], covariances_m2[..., 1, 1]
    det = xx * yy - xy * xy
    x, y = error[..., 0], error[..., 1]
    squared = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / det
    known = ~np.isnan(squared)
    inside = np.where(known, squared <= REGION_SIGMAS**2, np.nan)
    surprise = 0.5 * (squared + np.log(det))
    return Figures(
        np.nanmean(inside, axis=0),
        0.5 * np.nanmean(squared, axis=0),
        np.nanmean(np.where(known, surprise, np.nan), axis=0),
        np.nanmean(np.hypot(x, y), axis=0),
    )


def judge_model(model: PredictionModel, instants: TrackedInstants) -> Figures:
    """Return the figures of a model on tracked people."""
    places = predict_states(instants.states, instants.covariances, HORIZONS_S, model)
    return figures(*places, instants.later_m)


def fit(sets: Mapping[Any, TrackedInstants], start: PredictionModel) -> PredictionModel:
    """Return the model whose coverage and NEES are nearest to theirs on all sets and horizons."""
    first = np.log([max(getattr(start, name), 1e-3) for name in FITTED_SETTINGS])

    def loss(logs: FloatArray) -> float:
        if (np.abs(logs) > 6.0).any():
            return 1e6
        model = _with(start, logs)
        return float(np.mean([_loss(judge_model(model, each)) for each in sets.values()]))

    # Steps of 20 %, also for a setting whose logarithm is 0.
    corners = np.vstack([first, first + 0.2 * np.eye(len(first))])
    options = {"maxfev": _EVALUATIONS, "xatol": 5e-3, "fatol": 1e-3, "initial_simplex": corners}
    found = minimize(loss, first, method="Nelder-Mead", options=options)
    return _with(start, found.x)


def _with(start: PredictionModel, logs: FloatArray) -> PredictionModel:
    values = np.exp(logs).tolist()
    return start.model_copy(update=dict(zip(FITTED_SETTINGS, values, strict=True)))


def _loss(found: Figures) -> float:
    # A high power: what counts is the worst cell.
    off = (found.coverage - REGION_SHARE) / 0.03
    stray = np.clip(np.abs(np.log(found.nees)) - _NEES_SLACK, 0.0, None) / 0.1
    return float(np.mean(off**8 + stray**2 + _DENSITY_WEIGHT * found.surprise))
