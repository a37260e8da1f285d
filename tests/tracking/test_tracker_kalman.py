"""The Kalman filters of all people in one array: motion model, and updates against filterpy's."""

from __future__ import annotations

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from tracking_scenes import CAMERA, observe, white_acceleration

from tracking import PersonTracker
from tracking._kalman import correct
from tracking._motion import (
    damped_process_noise,
    damped_transition,
    predict,
    process_noise,
    transition,
)

Q_DENSITY_M2PS3 = 0.05
TAU_S = 1.0
PEOPLE, FRAMES = 15, 40

steps = st.floats(1e-3, 5.0)
densities = st.floats(1e-3, 10.0)


@pytest.mark.parametrize("dt_s", [0.01, 0.05, 0.4, 3.0])
def test_motion_solves_the_stochastic_differential_equation(dt_s: float) -> None:
    F, Q = white_acceleration(dt_s, 0.05)
    np.testing.assert_allclose(transition(dt_s), F, atol=1e-12)
    np.testing.assert_allclose(process_noise(dt_s, 0.05), Q, atol=1e-12)


@given(first=steps, second=steps, q=densities)
def test_two_steps_equal_one_step(first: float, second: float, q: float) -> None:
    F2 = transition(second)
    np.testing.assert_allclose(F2 @ transition(first), transition(first + second), atol=1e-12)
    np.testing.assert_allclose(
        F2 @ process_noise(first, q) @ F2.T + process_noise(second, q),
        process_noise(first + second, q),
        rtol=1e-9,
        atol=1e-15,
    )


def test_a_step_of_zero_changes_nothing() -> None:
    np.testing.assert_array_equal(transition(0.0), np.eye(4))
    np.testing.assert_array_equal(process_noise(0.0, 0.05), np.zeros((4, 4)))


@pytest.mark.parametrize("dt_s", [0.1, 0.5, 1.0])
def test_a_tracker_predicts_with_a_drift_of_022_mps_per_second(dt_s: float) -> None:
    """The default acceleration density is q = 0.05 m²/s³: √(q · 1 s) = 0.22 m/s, per axis."""
    tracker = PersonTracker()
    for step in range(30):
        now = 0.05 * step
        (track,) = tracker.update([observe((4.0, 1.2 * now), now)], now, CAMERA)
    (later,) = tracker.predict(now + dt_s)
    F, Q = white_acceleration(dt_s, 0.05)
    np.testing.assert_allclose(later.covariance_odom, F @ track.covariance_odom @ F.T + Q)


def covariances(rng: np.random.Generator, count: int, size: int) -> np.ndarray:
    root = rng.normal(0.0, 0.3, (count, size, size))
    return root @ root.transpose(0, 2, 1) + 0.01 * np.eye(size)


def filter_of(state: np.ndarray, covariance: np.ndarray) -> KalmanFilter:
    kalman = KalmanFilter(dim_x=4, dim_z=2)
    kalman.x, kalman.P, kalman.H = state.copy(), covariance.copy(), np.eye(2, 4)
    return kalman


@pytest.mark.parametrize("seed", range(3))
def test_the_batch_agrees_with_filterpy_for_every_person(seed: int) -> None:
    rng = np.random.default_rng(seed)
    states, spreads = rng.normal(0.0, 3.0, (PEOPLE, 4)), covariances(rng, PEOPLE, 4)
    reference = [filter_of(x, P) for x, P in zip(states, spreads, strict=True)]
    for _ in range(FRAMES):
        dt_s = float(rng.choice([1e-3, 0.03, 0.05, 0.4, 2.0]))
        # Some people are unseen and standing: their velocity decays in the last part of the step.
        damped_s = np.where(
            rng.uniform(size=PEOPLE) < 0.3, rng.choice([0.3, 0.8], PEOPLE) * dt_s, 0.0
        )
        damped_s[rng.uniform(size=PEOPLE) < 0.1] = dt_s
        states, spreads = predict(states, spreads, dt_s, damped_s, TAU_S, Q_DENSITY_M2PS3)
        for one, damped in zip(reference, damped_s.tolist(), strict=True):
            F, Q = white_acceleration(dt_s - damped, Q_DENSITY_M2PS3)
            one.predict(F=F, Q=Q)
            if damped > 0.0:
                one.predict(
                    F=damped_transition(np.array([damped]), TAU_S)[0],
                    Q=damped_process_noise(np.array([damped]), TAU_S, Q_DENSITY_M2PS3)[0],
                )
        rows = np.flatnonzero(rng.uniform(size=PEOPLE) < 0.8)
        measured = states[rows, :2] + rng.normal(0.0, 0.3, (len(rows), 2))
        noises = covariances(rng, len(rows), 2)
        states, spreads = states.copy(), spreads.copy()
        states[rows], spreads[rows] = correct(states[rows], spreads[rows], measured, noises)
        for row, z, R in zip(rows.tolist(), measured, noises, strict=True):
            reference[row].update(z, R=R)
        np.testing.assert_allclose(states, [one.x for one in reference], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(spreads, [one.P for one in reference], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("dt_s", [1e-7, 1e-4, 0.9e-3, 1.1e-3, 0.05, 0.7, 9.0])
def test_the_damped_motion_solves_its_stochastic_differential_equation(dt_s: float) -> None:
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1.0
    A[2, 2] = A[3, 3] = -1.0 / TAU_S
    W = np.diag([0.0, 0.0, Q_DENSITY_M2PS3, Q_DENSITY_M2PS3])
    block = expm(dt_s * np.block([[-A, W], [np.zeros((4, 4)), A.T]]))
    F = block[4:, 4:].T
    np.testing.assert_allclose(damped_transition(np.array([dt_s]), TAU_S)[0], F, atol=1e-12)
    Q = damped_process_noise(np.array([dt_s]), TAU_S, Q_DENSITY_M2PS3)[0]
    np.testing.assert_allclose(Q, F @ block[:4, 4:], rtol=1e-6, atol=1e-15)
    assert np.linalg.eigvalsh(Q)[0] >= -1e-12 * np.linalg.eigvalsh(Q)[-1]


def test_over_a_short_step_damped_motion_is_constant_velocity() -> None:
    dt_s = 1e-4
    F, Q = white_acceleration(dt_s, Q_DENSITY_M2PS3)
    short = np.array([dt_s])
    np.testing.assert_allclose(damped_transition(short, TAU_S)[0], F, atol=2e-4)
    noise = damped_process_noise(short, TAU_S, Q_DENSITY_M2PS3)[0]
    np.testing.assert_allclose(noise, Q, rtol=2e-4, atol=1e-18)
