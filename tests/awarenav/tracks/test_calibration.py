"""Calibration of the prediction: regions that hold on other people, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from awarenav.tracks._calibration import HORIZONS_S, FollowedPerson, calibrate
from awarenav.tracks._smoothing import SmoothedPath, smooth
from perception.arrays import FloatArray
from tracking import TrackingError
from tracking.prediction import REGION_SHARE

#: Covariance of tracks of people.
WALKING = np.kron([[0.01, 0.01], [0.01, 0.03]], np.eye(2))
PERIOD_S = 0.1


def people(count: int, spread: float, seed: int, seconds: float = 12.0) -> list[FollowedPerson]:
    """People who walk on, and whose velocity wanders; ``spread`` is what the tracks leave out."""
    rng = np.random.default_rng(seed)
    made = []
    steps = round(seconds / PERIOD_S)
    for index in range(count):
        stamps_s = 100.0 * index + PERIOD_S * np.arange(steps)
        # Heavy tails: some people wander three times as much as others.
        wild = spread * (0.5, 1.5)[index % 2]
        velocity = np.empty((steps, 2))
        velocity[0] = rng.normal(0.0, 1.0, 2)
        for step in range(1, steps):
            velocity[step] = velocity[step - 1] + wild * np.sqrt(PERIOD_S) * rng.normal(size=2)
        place = np.cumsum(PERIOD_S * velocity, axis=0)
        truth = np.hstack([place, velocity])
        states = truth + rng.normal(size=(steps, 4)) * [0.1, 0.1, 0.15, 0.15]
        covariances = np.repeat(WALKING[None], steps, axis=0)
        reference = SmoothedPath(stamps_s, truth, covariances)
        made.append(FollowedPerson(stamps_s, states, covariances, reference))
    return made


def chance(used: FloatArray, judged: FloatArray) -> FloatArray:
    """Return 2.5 standard errors of a share that is set on one half and counted on the other."""
    variance = REGION_SHARE * (1.0 - REGION_SHARE)
    return np.asarray(2.5 * np.sqrt(variance * (1.0 / used + 1.0 / judged)))


@pytest.mark.parametrize("spread", [0.1, 0.8])
def test_the_calibrated_region_holds_on_people_who_were_not_used(spread: float) -> None:
    """Whether the model was too wide or too narrow for these people."""
    found = calibrate(people(60, spread, seed=1))
    off = np.abs(found.before - REGION_SHARE)
    assert off.max() > 0.07  # so that there is something to correct
    assert (np.abs(found.coverage - REGION_SHARE) < chance(*found.stretches)).all()
    fresh = calibrate(people(80, spread, seed=2), found.model)
    assert (
        np.abs(fresh.before - REGION_SHARE) < chance(found.stretches[0], fresh.stretches[1])
    ).all()
    assert found.people == (30, 30)
    np.testing.assert_array_equal(found.stretches[0], 30 * np.floor(11.9 / np.array(HORIZONS_S)))


def test_factors_of_a_model_before_do_not_matter() -> None:
    crowd = people(12, 0.4, seed=3)
    plain = calibrate(crowd)
    again = calibrate(crowd, plain.model)
    assert again.model == plain.model
    np.testing.assert_array_equal(again.halves, plain.halves)
    assert (np.abs(again.before - REGION_SHARE) < 0.03).all()


def test_few_stretches_are_calibrated_more_cautiously() -> None:
    """The rank of the quantile counts the recordings' length, not their frame rate."""
    short = calibrate(people(4, 0.4, seed=5, seconds=14.0), horizons_s=[1.0])
    known = calibrate(people(4, 0.4, seed=5, seconds=14.0) * 40, horizons_s=[1.0])
    assert short.model.std_factors[0] > known.model.std_factors[0]


def person(seconds: float) -> FollowedPerson:
    """Return somebody who stands at the origin and is tracked for a time, at 10 Hz."""
    steps = round(10.0 * seconds)
    stamps_s, states = 0.1 * np.arange(steps), np.zeros((steps, 4))
    covariances = np.repeat(0.01 * np.eye(4)[None], steps, axis=0)
    path = SmoothedPath(stamps_s, states, covariances)
    return FollowedPerson(stamps_s, states, covariances, path)


PATH = person(1.0)
#: Calls, and what is said of their arguments.
CALLS: list[tuple[Callable[[], Any], str]] = [
    (lambda: calibrate([]), "needs 4 people or more who are tracked for 0.2 s, got 0"),
    (lambda: calibrate([person(12.0)] * 3, horizons_s=HORIZONS_S), "got 3"),
    (
        lambda: calibrate([person(6.0)] * 4),
        "too short for a horizon of 2 s: each half needs 10 stretches of that length with a person "
        "in track, got 4",
    ),
    (lambda: calibrate([person(12.0)] * 4, horizons_s=[]), "must increase from above 0 s"),
    (lambda: calibrate([person(12.0)] * 4, horizons_s=[1.0, 0.5]), "must increase from above 0 s"),
    (lambda: calibrate([person(12.0)] * 4, horizons_s=[0.0, 0.5]), "must increase from above 0 s"),
    (
        lambda: smooth(PATH.stamps_s[::-1], PATH.states, PATH.covariances),
        "must increase, got a step of -",
    ),
    (lambda: smooth(PATH.stamps_s, PATH.states[:-1], PATH.covariances), "states"),
    (
        lambda: smooth(PATH.stamps_s, PATH.states, np.full_like(PATH.covariances, math.nan)),
        "covariances",
    ),
]


@pytest.mark.parametrize(("call", "message"), CALLS)
def test_what_cannot_be_calibrated_is_refused(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(TrackingError, match=message):
        call()
