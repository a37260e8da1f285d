"""The prediction on tracked people: coverage, consistency and error by set, rate and horizon.

Every person is tracked alone, without clutter, so the motion model is judged, not association.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from tqdm import tqdm

from awarenav.baseline import MeasuredValue
from tracking import PersonTracker, TrackerConfig
from tracking.prediction import FITTED, REGION_SHARE, REGION_SIGMAS, PredictionModel, predict_states

from .._recordings import recordings_in, walks_of
from ._trackers import T_ODOM_CAMERA, observations
from ._walkers import FloatArray, walk

#: Horizons of the table, seconds.
HORIZONS_S: Final = np.array([0.2, 0.5, 1.0, 1.5, 2.0])
#: Wanted: the share of people inside the region, and the range of NEES/2.
COVERAGE_BAND: Final = (REGION_SHARE - 0.04, REGION_SHARE + 0.04)
NEES_BAND: Final = (0.8, 1.3)
RATES_HZ: Final = (10.0, 30.0)
NOISES_M: Final = (0.05, 0.15)
#: Seeds of the judged crowds; the shipped model was fitted to crowds with seeds from 100 on.
CROWDS: Final = range(5)
#: Constant velocity with a white acceleration, whose covariance grows by nothing else.
CONSTANT_VELOCITY: Final = PredictionModel(
    lag_per_s2=0.0, acceleration_density_m2ps3=0.05, change_mps=0.0, slow_change_mps=0.0, sway_s=0.0
)
_MISS_PROBABILITY: Final = 0.1
# Tracks are judged from this age on, every so often.
_WARM_UP_S, _EVERY_S = 1.0, 0.1
# Simulated crowds: people, length of a run, and rate of the truth.
_WALKERS, _WALKERS_S, _TRUTH_HZ = 12, 15.0, 30.0
# All people of a set share one tracker, so far apart that they never meet.
_TILE_M: Final = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredWalk:
    """One person: the truth, and what a sensor measured of it.

    Attributes:
        stamps_s: (n,) of the frames, from 0 on.
        measured_m: (n, 2), NaN where the frame missed the person.
        truth_s: (m,) stamps of the truth.
        truth_m: (m, 2) places.
    """

    stamps_s: FloatArray
    measured_m: FloatArray
    truth_s: FloatArray
    truth_m: FloatArray

    @classmethod
    def of(
        cls,
        truth_s: FloatArray,
        truth_m: FloatArray,
        rate_hz: float,
        noise_std_m: float,
        rng: np.random.Generator,
    ) -> MeasuredWalk:
        """Measure a person at a frame rate; one frame in ten misses them."""
        stamps_s = np.arange(0.0, truth_s[-1], 1.0 / rate_hz)
        places_m = _places_m(truth_s, truth_m, stamps_s)
        measured_m = places_m + rng.normal(0.0, noise_std_m, (len(stamps_s), 2))
        measured_m[rng.random(len(stamps_s)) < _MISS_PROBABILITY] = np.nan
        return cls(stamps_s, measured_m, truth_s, truth_m)


def _places_m(truth_s: FloatArray, truth_m: FloatArray, stamps_s: FloatArray) -> FloatArray:
    """Return the true places (T, 2), NaN after the end."""
    places = np.column_stack([np.interp(stamps_s, truth_s, truth_m[:, axis]) for axis in (0, 1)])
    places[stamps_s > truth_s[-1] + 1e-9] = np.nan
    return places


def recorded_walks(
    folder: Path, rate_hz: float, noise_std_m: float, seed: int
) -> list[MeasuredWalk]:
    """Return the people of every CSV in a folder, measured."""
    return [
        MeasuredWalk.of(
            samples[:, 0] - samples[0, 0],
            samples[:, 1:],
            rate_hz,
            noise_std_m,
            np.random.default_rng([seed, clip, person]),
        )
        for clip, path in enumerate(recordings_in(folder))
        for person, samples in enumerate(walks_of(path))
    ]


def simulated_walks(rate_hz: float, noise_std_m: float, seeds: Sequence[int]) -> list[MeasuredWalk]:
    """Return the walkers of the benchmark, measured."""
    made = []
    for seed in seeds:
        rng = np.random.default_rng([seed, 25])
        truth_s = np.arange(0.0, _WALKERS_S, 1.0 / _TRUTH_HZ)
        truth = walk(_WALKERS, truth_s, rng)
        made += [
            MeasuredWalk.of(truth_s, truth[:, person, :2], rate_hz, noise_std_m, rng)
            for person in range(_WALKERS)
        ]
    return made


class TrackedInstants(NamedTuple):
    """K instants of tracked people.

    Attributes:
        states: (K, 4) of the tracks, x, y, vx, vy, in the frame of the truth.
        covariances: (K, 4, 4).
        later_m: (K, T, 2) true places at the horizons, NaN after the end.
    """

    states: FloatArray
    covariances: FloatArray
    later_m: FloatArray


def track(walks: Sequence[MeasuredWalk], noise_std_m: float) -> TrackedInstants:
    """Track every person alone, with gates wide open, since gates cut off the tails."""
    tracker = PersonTracker(
        TrackerConfig(
            gate_probability=1.0 - 1e-12, gate_distance_m=50.0, miss_cost=1e3, confirm_logit=-100.0
        )
    )
    tiles = np.column_stack([_TILE_M * np.arange(len(walks)), np.zeros(len(walks))])
    stamps_s = max((each.stamps_s for each in walks), key=len)
    rows: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for frame, stamp_s in enumerate(stamps_s.tolist()):
        seen = [
            each.measured_m[frame] + tile
            for each, tile in zip(walks, tiles, strict=True)
            if frame < len(each.stamps_s) and np.isfinite(each.measured_m[frame, 0])
        ]
        frames = observations(np.array(seen).reshape(-1, 2), stamp_s, noise_std_m)
        tracks = tracker.update(frames, stamp_s, T_ODOM_CAMERA)
        if not _is_judged(stamp_s, stamps_s[1]):
            continue
        for each in tracks:
            index = round(float(each.position_odom_m[0]) / _TILE_M)
            walked = walks[index]
            if stamp_s + HORIZONS_S[0] <= walked.truth_s[-1]:
                place = each.position_odom_m - tiles[index]
                later_m = _places_m(walked.truth_s, walked.truth_m, stamp_s + HORIZONS_S)
                state = np.concatenate([place, each.velocity_odom_mps])
                rows.append((state, each.covariance_odom, later_m))
    return TrackedInstants(*(np.array(column) for column in zip(*rows, strict=True)))


def _is_judged(stamp_s: float, dt_s: float) -> bool:
    """Return whether the frame at a stamp is the first after a multiple of the interval."""
    if stamp_s < _WARM_UP_S:
        return False
    return int(stamp_s / _EVERY_S + 1e-6) > int((stamp_s - dt_s) / _EVERY_S + 1e-6)


class Figures(NamedTuple):
    """Figures of a prediction, one per horizon.

    Attributes:
        coverage: (T,) share of people inside the region of two standard deviations.
        nees: (T,) mean normalised squared error over its dimension; 1 if consistent.
        error_m: (T,) mean distance.
    """

    coverage: FloatArray
    nees: FloatArray
    error_m: FloatArray

    @property
    def holds(self) -> np.ndarray:
        """(T,) whether coverage and NEES are in their bands."""
        low, high = COVERAGE_BAND
        least, most = NEES_BAND
        covered = (self.coverage >= low) & (self.coverage <= high)
        return np.asarray(covered & (self.nees >= least) & (self.nees <= most))


def figures(means_m: FloatArray, covariances_m2: FloatArray, later_m: FloatArray) -> Figures:
    """Return the figures of predictions (K, T, 2) and (K, T, 2, 2) against places, NaN left out."""
    error = later_m - means_m
    squared = (error * np.linalg.solve(covariances_m2, error[..., None])[..., 0]).sum(axis=-1)
    inside = np.where(np.isnan(squared), np.nan, squared <= REGION_SIGMAS**2)
    return Figures(
        np.nanmean(inside, axis=0),
        0.5 * np.nanmean(squared, axis=0),
        np.nanmean(np.linalg.norm(error, axis=-1), axis=0),
    )


def judge_model(model: PredictionModel, instants: TrackedInstants) -> Figures:
    """Return the figures of a model on tracked people."""
    places = predict_states(instants.states, instants.covariances, HORIZONS_S, model)
    return figures(*places, instants.later_m)


def prediction_table(recordings: Path) -> tuple[list[MeasuredValue], list[str]]:
    """Print the table; return the figures and the cells that are not as wanted."""
    horizons = "".join(f"{horizon_s:>9g} s{'':10s}" for horizon_s in HORIZONS_S.tolist())
    print(f"\n{'prediction: inside 2 σ, NEES/2, error (m)':52s}{horizons}")
    if not recordings_in(recordings):
        print(f"left out, recorded people: no CSV in {recordings}", file=sys.stderr)
    metrics: list[MeasuredValue] = []
    missed: list[str] = []
    keys = [
        (source, rate_hz, noise_m)
        for source in ("recorded", "simulated")
        for rate_hz in RATES_HZ
        for noise_m in NOISES_M
    ]
    for source, rate_hz, noise_m in tqdm(keys, "prediction", leave=False, file=sys.stderr):
        walks = (
            recorded_walks(recordings, rate_hz, noise_m, 0)
            if source == "recorded"
            else simulated_walks(rate_hz, noise_m, CROWDS)
        )
        if not walks:
            continue
        instants = track(walks, noise_m)
        straight, ours = judge_model(CONSTANT_VELOCITY, instants), judge_model(FITTED, instants)
        key = f"{source:10s}{rate_hz:4g} Hz  σ {noise_m:4.2f} m"
        tqdm.write(_row(f"{key}  constant velocity", straight))
        tqdm.write(_row(f"{key}  ours", ours))
        where = f"prediction_{source}_{rate_hz:g}hz_{noise_m:g}m"
        for column, horizon_s in enumerate(HORIZONS_S.tolist()):
            metrics += _metrics(f"{where}_{horizon_s:g}s", ours, column)
            if not ours.holds[column]:
                missed.append(
                    f"{key}, {horizon_s:g} s: coverage {ours.coverage[column]:.3f}, "
                    f"NEES/2 {ours.nees[column]:.2f}"
                )
            if ours.error_m[column] > straight.error_m[column] + 1e-9:
                missed.append(f"{key}, {horizon_s:g} s: worse than constant velocity")
    return metrics, missed


def _metrics(name: str, found: Figures, column: int) -> list[MeasuredValue]:
    return [
        MeasuredValue(f"{name}_coverage", float(found.coverage[column]), "1", "higher", 0.02),
        MeasuredValue(f"{name}_nees_over_2", float(found.nees[column]), "1", "lower", 0.1),
        MeasuredValue(f"{name}_error", float(found.error_m[column]), "m", "lower", 0.05),
    ]


def _row(name: str, found: Figures) -> str:
    cells = "".join(
        f"{covered:8.1%} {nees:5.2f} {error_m:5.3f}{' ' if holds else '*'}"
        for covered, nees, error_m, holds in zip(*found, found.holds, strict=True)
    )
    return f"{name:52s}{cells}"
