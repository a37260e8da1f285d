"""Calibration of the prediction on recordings of one's own: split conformal prediction.

The normalised squared errors of tracked people are ranked for each horizon. The quantile that
belongs to the region of two standard deviations gives the factor for that horizon. If new people
are like those of the recording, the region covers at least the wanted share of them on average,
whatever the distribution (Vovk, Gammerman, Shafer, *Algorithmic Learning in a Random World*, 2005).

To check this, the people are divided at random into two halves, and each is judged by the factors
of the other. The factors that are returned are those of all people.

Instants of one person are alike. The rank therefore counts stretches of the length of the horizon
that do not overlap, not instants.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from perception.arrays import FloatArray, finite_array
from tracking import TrackingError
from tracking.prediction import FITTED, REGION_SHARE, REGION_SIGMAS, PredictionModel, predict_states

from ._smoothing import SmoothedPath
from ._units import refuse_other_units

#: Horizons that a calibration uses unless it is told otherwise, seconds.
HORIZONS_S: Final = (0.2, 0.5, 1.0, 1.5, 2.0)
#: Stretches that each half must have at the longest horizon.
LEAST_STRETCHES: Final = 10
_LEAST_PEOPLE: Final = 4
_FACTORS: Final = (0.1, 10.0)
# Of the division into halves: the same recordings give the same model.
_SEED: Final = 0


@dataclass(frozen=True, slots=True, eq=False)
class FollowedPerson:
    """The track of one person, and the path that counts as the truth.

    Attributes:
        stamps_s: (N,) increasing.
        states: (N, 4) x, y (m), vx, vy (m/s) of the track.
        covariances: (N, 4, 4).
        reference: the path; ``_smoothing.smooth`` makes it from the track.
    """

    stamps_s: FloatArray
    states: FloatArray
    covariances: FloatArray
    reference: SmoothedPath


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The calibrated model, and how its factors were checked.

    Attributes:
        model: with the factors of all people.
        horizons_s: (T,).
        people: numbers of people in the two halves.
        stretches: (2, T) stretches that do not overlap in both halves.
        before: (T,) share of all people inside the region of the model as it was.
        halves: (2, T) share of each half inside the region by the factors of the other.
        nees: (T,) mean normalised squared error over 2, likewise of both halves.
    """

    model: PredictionModel
    horizons_s: FloatArray
    people: tuple[int, int]
    stretches: FloatArray
    before: FloatArray
    halves: FloatArray
    nees: FloatArray

    @property
    def coverage(self) -> FloatArray:
        """(T,) mean of ``halves``."""
        return np.asarray(self.halves.mean(axis=0))


def calibrate(
    people: Sequence[FollowedPerson],
    model: PredictionModel = FITTED,
    horizons_s: Any = HORIZONS_S,
) -> Calibration:
    """Return a model whose region covers the wanted share of people at each horizon.

    Args:
        people: of one or several recordings.
        model: to start from; its own factors are replaced.
        horizons_s: (T,) increasing, > 0.

    Raises:
        TrackingError: for horizons that are not valid, recordings that are too short, and people
            who walk at no speed of people, as numbers of frames for seconds give.
    """
    times = finite_array("horizons_s", horizons_s, ("T",), TrackingError)
    if not len(times) or times[0] <= 0.0 or bool((np.diff(times) <= 0.0).any()):
        raise TrackingError(f"horizons_s must increase from above 0 s, got {times.tolist()}")
    refuse_other_units(
        "the recordings",
        ((each.reference.stamps_s, each.reference.states[:, :2]) for each in people),
    )
    plain = model.model_copy(update={"horizons_s": (), "std_factors": ()})
    usable = [each for each in people if each.stamps_s[-1] - each.stamps_s[0] >= times[0]]
    if len(usable) < _LEAST_PEOPLE:
        raise TrackingError(
            f"a calibration needs {_LEAST_PEOPLE} people or more who are tracked for "
            f"{times[0]:g} s, got {len(usable)}"
        )
    order = np.random.default_rng(_SEED).permutation(len(usable)).tolist()
    halves = [usable[index] for index in order[::2]], [usable[index] for index in order[1::2]]
    stretches = np.array([_stretches(half, times) for half in halves])
    fewest = int(stretches[:, -1].min())
    if fewest < LEAST_STRETCHES:
        raise TrackingError(
            f"the recording is too short for a horizon of {times[-1]:g} s: each half needs "
            f"{LEAST_STRETCHES} stretches of that length with a person in track, got {fewest}; "
            "record longer, or calibrate for shorter horizons"
        )
    made = [_calibrated(half, times, plain) for half in (*halves, usable)]
    checked = [
        _squared_errors(halves[1], times, made[0]),
        _squared_errors(halves[0], times, made[1]),
    ]
    return Calibration(
        made[2],
        times,
        (len(halves[0]), len(halves[1])),
        stretches,
        _inside(_squared_errors(usable, times, model)),
        np.array([_inside(squared) for squared in checked]),
        0.5 * np.nanmean(np.concatenate(checked), axis=0),
    )


def _calibrated(
    people: Sequence[FollowedPerson], times: FloatArray, plain: PredictionModel
) -> PredictionModel:
    """Return the model with the factors of these people."""
    squared = _squared_errors(people, times, plain)
    counts = _stretches(people, times).astype(int).tolist()
    factors = [
        math.sqrt(_quantile(column, count)) / REGION_SIGMAS
        for column, count in zip(squared.T, counts, strict=True)
    ]
    bounded = tuple(round(float(np.clip(each, *_FACTORS)), 4) for each in factors)
    return plain.model_copy(update={"horizons_s": tuple(times.tolist()), "std_factors": bounded})


def _stretches(half: Sequence[FollowedPerson], times: FloatArray) -> FloatArray:
    """Return the number (T,) of stretches of each horizon that do not overlap."""
    spans_s = np.array([each.stamps_s[-1] - each.stamps_s[0] for each in half])
    return np.asarray(np.floor(spans_s[:, None] / times + 1e-9).sum(axis=0))


def _squared_errors(
    half: Sequence[FollowedPerson], times: FloatArray, model: PredictionModel
) -> FloatArray:
    """Return the normalised squared errors (K, T) of all instants, NaN after a track's end."""
    found = []
    for each in half:
        means, covariances = predict_states(each.states, each.covariances, times, model)
        later = np.stack([each.reference.places_m(each.stamps_s + t) for t in times], axis=1)
        error = (later - means)[..., None]
        solved = np.linalg.solve(covariances, error)
        found.append((error * solved).sum(axis=(-2, -1)))
    return np.concatenate(found)


def _quantile(squared: FloatArray, stretches: int) -> float:
    """Return the conformal quantile of squared errors, with the rank of so many stretches."""
    known = squared[np.isfinite(squared)]
    level = min(math.ceil((stretches + 1) * REGION_SHARE) / stretches, 1.0)
    return float(np.quantile(known, level, method="higher"))


def _inside(squared: FloatArray) -> FloatArray:
    known = np.isfinite(squared)
    return np.asarray(((squared <= REGION_SIGMAS**2) & known).sum(axis=0) / known.sum(axis=0))
