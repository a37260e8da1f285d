"""The table of the prediction: coverage, consistency and error by set, rate, noise and horizon."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from tqdm import tqdm

from awarenav.baseline import MeasuredValue
from tracking import TrackerConfig
from tracking.prediction import FITTED, PredictionModel, predict_states

from ._prediction_fit import FITTED_SETTINGS, Figures, figures, fit, judge_model
from ._prediction_imm import predict_by_imm
from ._prediction_sets import (
    HORIZONS_S,
    TrackedInstants,
    recorded_walks,
    simulated_walks,
    track,
)
from ._walkers import FloatArray

RATES_HZ: Final = (10.0, 30.0)
NOISES_M: Final = (0.05, 0.15)
#: Seeds of simulated crowds that are judged; the model was fitted to those from 100 on.
JUDGED_CROWDS: Final = 5
_FIT_FROM: Final = 100
#: The fit uses one instant in so many: neighbours are alike.
_THINNED: Final = 3
#: The earlier formula of the exporters: q, and the growth of the variance per second.
_EARLIER_M2PS3, _EARLIER_PER_S = 0.05, 0.75


class Condition(NamedTuple):
    """A set of people and how they were measured."""

    source: str
    rate_hz: float
    noise_std_m: float

    def __str__(self) -> str:
        """Return a line of the table's key."""
        return f"{self.source:10s}{self.rate_hz:4g} Hz  σ {self.noise_std_m:4.2f} m"


def conditions(recordings: Path, crowds: range, seed: int) -> dict[Condition, TrackedInstants]:
    """Track everybody of each set, rate and noise; recorded people are left out if there are none.

    Args:
        recordings: folder of CSV files.
        crowds: seeds of the simulated crowds.
        seed: of the measurements of recorded people.
    """
    found = {}
    config = TrackerConfig()
    keys = [
        Condition(source, rate_hz, noise_m)
        for source in ("recorded", "simulated")
        for rate_hz in RATES_HZ
        for noise_m in NOISES_M
    ]
    for key in tqdm(keys, "tracks", leave=False, file=sys.stderr):
        if key.source == "recorded":
            walks = recorded_walks(recordings, key.rate_hz, key.noise_std_m, seed)
        else:
            walks = simulated_walks(key.rate_hz, key.noise_std_m, crowds)
        if walks:
            found[key] = track(walks, config)
    if not any(key.source == "recorded" for key in found):
        print(f"left out, recorded people: no CSV in {recordings}", file=sys.stderr)
    return found


def by_earlier_formula(instants: TrackedInstants, growth_per_s: float = _EARLIER_PER_S) -> Figures:
    """Return the figures of constant velocity whose covariance grows by a share per second."""
    plain = PredictionModel(
        lag_per_s2=0.0,
        acceleration_density_m2ps3=_EARLIER_M2PS3,
        change_mps=0.0,
        slow_change_mps=0.0,
        sway_s=0.0,
    )
    means, covariances = predict_states(instants.states, instants.covariances, HORIZONS_S, plain)
    wider = (1.0 + growth_per_s * HORIZONS_S)[:, None, None]
    return figures(means, wider * covariances, instants.later_m)


def prediction_table(recordings: Path) -> tuple[list[MeasuredValue], list[str]]:
    """Print the table; return the figures and the cells that are not as wanted."""
    metrics: list[MeasuredValue] = []
    missed: list[str] = []
    _print_header()
    for key, instants in conditions(recordings, range(JUDGED_CROWDS), 0).items():
        rows = {
            "constant velocity": by_earlier_formula(instants, 0.0),
            "before": by_earlier_formula(instants),
            "ours": judge_model(FITTED, instants),
        }
        for name, found in rows.items():
            _print_row(f"{key}  {name}", found)
        ours, where = rows["ours"], f"{key.source}_{key.rate_hz:g}hz_{key.noise_std_m:g}m"
        for column, horizon_s in enumerate(HORIZONS_S.tolist()):
            metrics += _metrics(f"prediction_{where}_{horizon_s:g}s", ours, column)
            if not ours.holds[column]:
                missed.append(
                    f"prediction, {key}, {horizon_s:g} s: coverage {ours.coverage[column]:.3f}, "
                    f"NEES/2 {ours.nees[column]:.2f}"
                )
            if ours.error_m[column] > rows["constant velocity"].error_m[column] + 1e-9:
                missed.append(f"prediction, {key}, {horizon_s:g} s: worse than constant velocity")
    return metrics, missed


def fit_table(recordings: Path) -> None:
    """Fit the model anew, and print it with every clip judged by a fit to the others."""
    used = conditions(recordings, range(_FIT_FROM, _FIT_FROM + JUDGED_CROWDS), _FIT_FROM)
    thinned = {key: each.take(slice(None, None, _THINNED)) for key, each in used.items()}
    found = fit(thinned, FITTED)
    print("\nfitted: " + _settings_text(found))
    clips = sorted(
        {
            int(group)
            for key, each in used.items()
            if key.source == "recorded"
            for group in each.groups
        }
    )
    judged = {
        key: track(recorded_walks(recordings, key.rate_hz, key.noise_std_m, 0), TrackerConfig())
        for key in used
        if key.source == "recorded"
    }
    parts: dict[Condition, list[tuple[FloatArray, FloatArray, FloatArray]]] = {
        key: [] for key in judged
    }
    for clip in tqdm(clips, "leaving one clip out", leave=False, file=sys.stderr):
        model = fit(_without(thinned, clip), FITTED)
        tqdm.write(f"without clip {clip}: {_settings_text(model)}")
        for key, instants in judged.items():
            alone = instants.take(instants.groups == clip)
            places = predict_states(alone.states, alone.covariances, HORIZONS_S, model)
            parts[key].append((*places, alone.later_m))
            _print_row(f"  {key}", figures(*places, alone.later_m))
    print("every clip by the fit to the others:")
    for key, made in parts.items():
        if made:
            _print_row(f"{key}", figures(*map(np.concatenate, zip(*made, strict=True))))
    print("filterpy's IMM estimator:")
    for key in used:
        if key.source == "recorded":
            walks = recorded_walks(recordings, key.rate_hz, key.noise_std_m, 0)
        else:
            walks = simulated_walks(key.rate_hz, key.noise_std_m, range(2))
        _print_row(f"{key}", figures(*predict_by_imm(walks)))


def _without(
    sets: Mapping[Condition, TrackedInstants], clip: int
) -> dict[Condition, TrackedInstants]:
    return {
        key: each.take(each.groups != clip) if key.source == "recorded" else each
        for key, each in sets.items()
    }


def _metrics(name: str, found: Figures, column: int) -> list[MeasuredValue]:
    return [
        MeasuredValue(f"{name}_coverage", float(found.coverage[column]), "1", "higher", 0.02),
        MeasuredValue(f"{name}_nees_over_2", float(found.nees[column]), "1", "lower", 0.1),
        MeasuredValue(f"{name}_error", float(found.error_m[column]), "m", "lower", 0.05),
    ]


def _settings_text(model: PredictionModel) -> str:
    return ", ".join(f"{name} {getattr(model, name):.3g}" for name in FITTED_SETTINGS)


def _print_header() -> None:
    horizons = "".join(f"{horizon_s:>9g} s{'':10s}" for horizon_s in HORIZONS_S.tolist())
    print(f"\n{'prediction: inside 2 σ, NEES/2, error (m)':52s}{horizons}")


def _print_row(name: str, found: Figures) -> None:
    cells = "".join(
        f"{covered:8.1%} {nees:5.2f} {error_m:5.3f}{' ' if holds else '*'}"
        for covered, nees, error_m, holds in zip(
            found.coverage, found.nees, found.error_m, found.holds, strict=True
        )
    )
    print(f"{name:52s}{cells}", flush=True)
