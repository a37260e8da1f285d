"""Calibration of the prediction: coverage of people who were not used, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from perception.arrays import FloatArray
from tracking import TrackingError
from tracking.calibration import HORIZONS_S, FollowedPerson, calibrate
from tracking.prediction import REGION_SHARE, PredictionModel
from tracking.smoothing import SmoothedPath

PERIOD_S = 0.1
COVARIANCE = np.kron([[0.01, 0.01], [0.01, 0.03]], np.eye(2))


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
        covariances = np.repeat(COVARIANCE[None], steps, axis=0)
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


@pytest.mark.parametrize(
    ("crowd", "horizons_s", "words"),
    [
        ([], HORIZONS_S, "needs 4 people or more who are tracked for 0.2 s, got 0"),
        (people(3, 0.2, 0), HORIZONS_S, "got 3"),
        (
            people(4, 0.2, 0, seconds=6.0),
            HORIZONS_S,
            "too short for a horizon of 2 s: each half needs 10 stretches of that length "
            "with a person in track, got 4",
        ),
        (people(4, 0.2, 0), [], "must increase from above 0 s"),
        (people(4, 0.2, 0), [1.0, 0.5], "must increase from above 0 s"),
        (people(4, 0.2, 0), [0.0, 0.5], "must increase from above 0 s"),
    ],
)
def test_what_cannot_be_calibrated_is_refused(
    crowd: list[FollowedPerson], horizons_s: list[float], words: str
) -> None:
    with pytest.raises(TrackingError) as refused:
        calibrate(crowd, horizons_s=horizons_s)
    assert words in str(refused.value)


def test_a_calibration_is_read_as_it_was_written_or_not_at_all(tmp_path: Path) -> None:
    model = PredictionModel(horizons_s=(0.2, 1.0, 2.0), std_factors=(0.9, 1.1, 1.3))
    path = tmp_path / "prediction.yaml"
    model.to_yaml(path)
    assert PredictionModel.from_calibration(path) == model
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    for kept in range(len(lines)):  # as a copy that was interrupted leaves it
        path.write_text("".join(lines[:kept]), encoding="utf-8")
        with pytest.raises(TrackingError, match=r"prediction\.yaml"):
            PredictionModel.from_calibration(path)


def test_a_file_without_factors_is_a_model_and_no_calibration(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("sway_s: 0.03\nhorizons_s: []\n", encoding="utf-8")
    assert PredictionModel.from_yaml(path).sway_s == 0.03
    with pytest.raises(TrackingError, match=r"must be a whole file of .* but has no std_factors$"):
        PredictionModel.from_calibration(path)
