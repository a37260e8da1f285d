"""Prediction of people: against sampled walks, never beyond the envelope."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import track_of

from perception.arrays import FloatArray
from tracking import TrackingError
from tracking.prediction import (
    FITTED,
    REGION_SHARE,
    REGION_SIGMAS,
    PredictionModel,
    envelope_of,
    predict_ahead,
    predict_states,
)

#: Covariances of tracks of people.
UNCERTAIN = np.kron([[0.02, 0.02], [0.02, 0.05]], np.eye(2))
TIMES_S = np.array([0.0, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0])


def finite(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


@st.composite
def covariances(draw: st.DrawFn) -> FloatArray:
    """Covariances of tracks: position and velocity errors that are not opposed on either axis."""
    place, drift = draw(finite(0.001, 1.0)), draw(finite(0.001, 2.0))
    cross = draw(finite(0.0, 0.9)) * math.sqrt(place * drift)
    turn = draw(finite(-math.pi, math.pi))
    narrow = draw(finite(0.1, 1.0))
    c, s = math.cos(turn), math.sin(turn)
    axes = np.array([[c, -s], [s, c]]) @ np.diag([1.0, narrow]) @ np.array([[c, s], [-s, c]])
    return np.kron(np.array([[place, cross], [cross, drift]]), axes)


@st.composite
def models(draw: st.DrawFn) -> PredictionModel:
    factors = sorted(draw(st.lists(finite(0.2, 3.0), min_size=2, max_size=2)))
    return PredictionModel(
        lag_per_s2=draw(finite(0.0, 10.0)),
        response_s=draw(finite(0.05, 3.0)),
        change_mps=draw(finite(0.0, 2.0)),
        slow_change_mps=draw(finite(0.0, 3.0)),
        sway_s=draw(finite(0.0, 0.5)),
        max_speed_mps=draw(finite(0.5, 6.0)),
        max_acceleration_mps2=draw(finite(0.2, 8.0)),
        horizons_s=(0.5, 2.0),
        std_factors=tuple(factors),
    )


states = st.lists(finite(-5.0, 5.0), min_size=4, max_size=4).map(lambda row: np.array([row]))


def test_the_covariance_is_that_of_sampled_people() -> None:
    """People whose velocity approaches another one, sampled in small steps."""
    model = PredictionModel(max_acceleration_mps2=50.0, max_speed_mps=15.0, sway_s=0.0)
    root = np.array([[0.1, 0, 0, 0], [0, 0.08, 0, 0], [0.1, 0, 0.15, 0], [0, 0.1, 0.05, 0.2]])
    covariance, state = root @ root.T, np.array([1.0, -2.0, 0.6, 0.4])
    rng = np.random.default_rng(25)
    count, step_s, steps = 20_000, 0.01, 150
    memory_s2 = np.trace(covariance[:2, :2]) / np.trace(covariance[2:, 2:])
    lag = 1.0 + model.lag_per_s2 * memory_s2
    people = state + math.sqrt(lag) * rng.normal(size=(count, 4)) @ root.T
    place, base = people[:, :2].copy(), people[:, 2:].copy()
    speed_mps = math.hypot(0.6, 0.4)
    slow_mps = model.slow_change_mps * math.exp(-((speed_mps / model.slow_below_mps) ** 2))
    change = math.hypot(slow_mps, model.change_mps) * rng.normal(size=(count, 2))
    drift = np.zeros((count, 2))
    for step in range(steps):
        reached = 1.0 - math.exp(-(step + 0.5) * step_s / model.response_s)
        noise = math.sqrt(model.acceleration_density_m2ps3 * step_s) * rng.normal(size=(count, 2))
        place += step_s * (base + reached * change + drift + 0.5 * noise)
        drift += noise
    found = predict_states(state[None], covariance[None], [steps * step_s], model)
    np.testing.assert_allclose(place.mean(axis=0), found.means_odom_m[0, 0], atol=0.02)
    np.testing.assert_allclose(
        np.cov(place.T), found.covariances_odom_m2[0, 0], rtol=0.05, atol=4e-3
    )
    error = place - found.means_odom_m[0, 0]
    squared = (error * np.linalg.solve(found.covariances_odom_m2[0, 0], error.T).T).sum(axis=1)
    assert (squared <= REGION_SIGMAS**2).mean() == pytest.approx(REGION_SHARE, abs=0.01)


@given(state=states, covariance=covariances())
def test_the_covariance_grows_with_the_horizon(state: FloatArray, covariance: FloatArray) -> None:
    """In every direction, and for every speed."""
    found = predict_states(state, covariance[None], TIMES_S).covariances_odom_m2[0]
    growth = np.diff(found, axis=0)
    assert (np.linalg.eigvalsh(growth) > -1e-9).all()
    assert (np.linalg.eigvalsh(found) > 0.0).all()


@given(state=states, covariance=covariances(), model=models(), angle=finite(-math.pi, math.pi))
def test_nothing_is_predicted_outside_the_envelope(state, covariance, model, angle) -> None:
    """The region reaches beyond the track's own uncertainty only as far as a person can get."""
    found = predict_states(state, covariance[None], TIMES_S, model)
    track = track_of(position=state[0, :2], velocity=state[0, 2:], covariance=covariance)
    envelope = envelope_of(track, TIMES_S, model)
    direction = np.array([math.cos(angle), math.sin(angle)])
    still = model.model_copy(
        update={
            "change_mps": 0.0,
            "slow_change_mps": 0.0,
            "sway_s": 0.0,
            "acceleration_density_m2ps3": 0.0,
        }
    )
    known = predict_states(state, covariance[None], TIMES_S, still).covariances_odom_m2[0]
    whole = found.covariances_odom_m2[0]
    own_m = REGION_SIGMAS * np.sqrt(direction @ known @ direction)
    rim_m = REGION_SIGMAS * np.sqrt(direction @ whole @ direction)
    beyond_m = np.maximum(rim_m - own_m, 0.0)
    rim = found.means_odom_m[0] + beyond_m[:, None] * direction
    assert envelope.contains(found.means_odom_m, slack_m=1e-9).all()
    assert envelope.contains(rim[None], slack_m=1e-7).all()
    fastest_mps = max(model.max_speed_mps, math.hypot(*state[0, 2:]))
    moved_m = np.linalg.norm(rim - state[0, :2], axis=1)
    assert (moved_m <= fastest_mps * TIMES_S + 1e-7).all()


def test_the_envelope_holds_a_person_who_accelerates_as_hard_as_people_can() -> None:
    track = track_of(position=(1.0, 2.0), velocity=(1.0, 0.0))
    envelope = envelope_of(track, TIMES_S)
    a, v = FITTED.max_acceleration_mps2, FITTED.max_speed_mps
    aside = np.column_stack([1.0 + TIMES_S, 2.0 + 0.5 * a * TIMES_S**2])
    assert envelope.contains(aside[None])[0, :4].all()
    assert not envelope.contains(aside[None])[0, -1]  # faster than people are
    faster = np.column_stack([1.0 + (v + 0.1) * TIMES_S, np.full(len(TIMES_S), 2.0)])
    assert not envelope.contains(faster[None])[0, 3:].any()


def test_the_mean_keeps_the_velocity_and_the_region_turns_with_the_person() -> None:
    east = predict_ahead(track_of(velocity=(1.4, 0.0), covariance=UNCERTAIN), TIMES_S)
    north = predict_ahead(track_of(velocity=(0.0, 1.4), covariance=UNCERTAIN), TIMES_S)
    np.testing.assert_allclose(east.means_odom_m[0, :, 0], 1.4 * TIMES_S)
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    turned = turn @ east.covariances_odom_m2 @ turn.T
    np.testing.assert_allclose(north.covariances_odom_m2, turned, atol=1e-12)
    # People sway across their way, not along it.
    assert (east.covariances_odom_m2[0, 2:, 1, 1] > east.covariances_odom_m2[0, 2:, 0, 0]).all()


def test_slow_people_are_less_predictable_than_walking_ones() -> None:
    spread = [
        float(
            np.trace(predict_ahead(track_of(velocity=(v, 0), covariance=UNCERTAIN), [2.0])[1][0, 0])
        )
        for v in (0.0, 0.5, 1.0, 1.5, 2.0)
    ]
    assert spread[:4] == sorted(spread, reverse=True)[:4]


def test_several_people_are_predicted_as_each_alone() -> None:
    tracks = [track_of(position=(x, 1.0), velocity=(0.3 * x, -0.2)) for x in (0.0, 1.0, 4.0)]
    together = predict_ahead(tracks, TIMES_S)
    for index, track in enumerate(tracks):
        alone = predict_ahead(track, TIMES_S)
        np.testing.assert_array_equal(together.means_odom_m[index], alone.means_odom_m[0])
        np.testing.assert_array_equal(
            together.covariances_odom_m2[index], alone.covariances_odom_m2[0]
        )
    nobody = predict_ahead([], TIMES_S)
    assert nobody.means_odom_m.shape == (0, 8, 2)
    assert nobody.covariances_odom_m2.shape == (0, 8, 2, 2)


def test_factors_scale_the_standard_deviations_between_their_horizons() -> None:
    model = PredictionModel(horizons_s=(0.5, 1.5), std_factors=(1.0, 2.0))
    track = track_of(velocity=(1.2, 0.0))
    times_s = [0.2, 0.5, 1.0, 1.5, 2.0]
    plain = predict_ahead(track, times_s).covariances_odom_m2[0]
    scaled = predict_ahead(track, times_s, model).covariances_odom_m2[0]
    ratio = np.sqrt(scaled[:, 0, 0] / plain[:, 0, 0])
    np.testing.assert_allclose(ratio, [1.0, 1.0, 1.5, 2.0, 2.0])


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
