"""The tracker's covariance against simulated walkers, and its numbers against plain numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2
from tracking_scenes import camera_at, observe, white_acceleration

from tracking import PersonTracker, TrackerConfig

# Consistency is a property of the filter, and gates would cut its tails off, so they are wide open.
# The simulated truth is white acceleration, without standing people.
CONFIG = TrackerConfig(
    gate_probability=1.0 - 1e-12,
    gate_distance_m=50.0,
    miss_cost=1e3,
    standing_speed_mps=0.0,
    position_noise_floor_m=0.01,
    confirm_hits=1,
)
NOISE_M2 = np.array([[0.02, 0.008], [0.008, 0.05]])
WALKERS, FRAMES = 120, 20
STEPS_S = np.linspace(0.03, 0.4, 12)


@pytest.fixture(scope="module")
def errors() -> tuple[np.ndarray, np.ndarray]:
    """Return NEES (WALKERS, FRAMES) and NIS (WALKERS, FRAMES - 1) at steps of 0.03 to 0.4 s."""
    rng = np.random.default_rng(7)
    noise_root = np.linalg.cholesky(NOISE_M2)
    nees, nis = np.empty((WALKERS, FRAMES)), np.empty((WALKERS, FRAMES - 1))
    for walker in range(WALKERS):
        tracker, now = PersonTracker(CONFIG), 0.0
        truth = np.concatenate(
            [rng.uniform(-3.0, 3.0, 2), rng.normal(0.0, CONFIG.initial_velocity_std_mps, 2)]
        )
        for frame in range(FRAMES):
            if frame:
                dt_s = float(rng.choice(STEPS_S))
                F, Q = white_acceleration(dt_s, CONFIG.acceleration_density_m2ps3)
                truth = F @ truth + np.linalg.cholesky(Q) @ rng.normal(size=4)
                now += dt_s
            measured = truth[:2] + noise_root @ rng.normal(size=2)
            if frame:
                (expected,) = tracker.predict(now)
                innovation = measured - expected.position_odom_m
                S = expected.covariance_odom[:2, :2] + NOISE_M2
                nis[walker, frame - 1] = innovation @ np.linalg.solve(S, innovation)
            camera = camera_at(*rng.uniform(-2, 2, 2), rng.uniform(-3, 3), 0.2)
            seen = observe(measured, now, T_odom_camera=camera, covariance_odom_m2=NOISE_M2)
            (track,) = tracker.update([seen], now, camera)
            error = truth - np.concatenate([track.position_odom_m, track.velocity_odom_mps])
            nees[walker, frame] = error @ np.linalg.solve(track.covariance_odom, error)
    return nees, nis


def test_estimation_errors_match_the_covariance(
    errors: tuple[np.ndarray, np.ndarray],
) -> None:
    nees, _ = errors
    # Walkers are independent but frames of one walker are not: one two-sided test per frame, at a
    # level that all of them pass together with 99 %.
    level = 0.01 / FRAMES
    low, high = chi2.ppf([level / 2, 1.0 - level / 2], df=4 * WALKERS)
    assert (nees.sum(axis=0) > low).all()
    assert (nees.sum(axis=0) < high).all()


def test_innovations_match_the_covariance_and_are_white(
    errors: tuple[np.ndarray, np.ndarray],
) -> None:
    _, nis = errors
    low, high = chi2.ppf([0.005, 0.995], df=2 * nis.size)
    assert low < nis.sum() < high
    centred = nis - nis.mean()
    lag_one = float((centred[:, 1:] * centred[:, :-1]).mean() / centred.var())
    assert abs(lag_one) < 3.0 / np.sqrt(nis[:, 1:].size)


def test_coasting_errors_match_the_covariance() -> None:
    rng = np.random.default_rng(11)
    q = CONFIG.acceleration_density_m2ps3
    total, walkers = 0.0, 150
    F, Q = white_acceleration(0.1, q)
    F_gap, Q_gap = white_acceleration(1.5, q)
    for _ in range(walkers):
        tracker = PersonTracker(CONFIG)
        truth = np.concatenate([rng.uniform(-3, 3, 2), rng.normal(0.0, 1.0, 2)])
        for frame in range(8):
            if frame:
                truth = F @ truth + np.linalg.cholesky(Q) @ rng.normal(size=4)
            measured = truth[:2] + rng.normal(0.0, 0.1, 2)
            tracker.update([observe(measured, 0.1 * frame)], 0.1 * frame, camera_at())
        truth = F_gap @ truth + np.linalg.cholesky(Q_gap) @ rng.normal(size=4)
        (track,) = tracker.predict(0.7 + 1.5)
        error = truth - np.concatenate([track.position_odom_m, track.velocity_odom_mps])
        total += error @ np.linalg.solve(track.covariance_odom, error)
    low, high = chi2.ppf([0.005, 0.995], df=4 * walkers)
    assert low < total < high


@given(
    low=st.floats(0.0, 1.0),
    extra=st.floats(0.0, 1.0),
    angle=st.floats(-np.pi, np.pi),
    floor_m=st.floats(0.01, 1.0),
)
def test_the_noise_floor_raises_eigenvalues_and_keeps_directions(
    low: float, extra: float, angle: float, floor_m: float
) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    eigenvalues = np.array([low, low + extra])
    measured_m2 = turn @ np.diag(eigenvalues) @ turn.T
    tracker = PersonTracker(TrackerConfig(position_noise_floor_m=floor_m))
    seen = observe((3.0, 0.0), 0.0, covariance_odom_m2=measured_m2)
    (track,) = tracker.update([seen], 0.0, camera_at())
    expected = turn @ np.diag(np.maximum(eigenvalues, floor_m**2)) @ turn.T
    np.testing.assert_allclose(track.covariance_odom[:2, :2], expected, atol=1e-9)


def test_the_tracker_is_the_textbook_kalman_filter() -> None:
    rng = np.random.default_rng(3)
    tracker = PersonTracker(CONFIG)
    H = np.eye(2, 4)
    now, x, P = 0.0, np.zeros(4), np.zeros((4, 4))
    for frame in range(40):
        dt_s = float(rng.choice([0.0, 0.03, 0.05, 0.4]))
        now += dt_s
        R = NOISE_M2 * rng.uniform(0.5, 2.0)
        z = np.array([2.0 + 1.2 * now, -0.3 * now]) + np.linalg.cholesky(R) @ rng.normal(size=2)
        if frame == 0:
            x, P = np.array([*z, 0.0, 0.0]), np.diag([0.0, 0.0, 1.0, 1.0])
            P[:2, :2] = R
        else:
            F, Q = white_acceleration(dt_s, CONFIG.acceleration_density_m2ps3)
            x, P = F @ x, F @ P @ F.T + Q
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            x, P = x + K @ (z - H @ x), (np.eye(4) - K @ H) @ P
        (track,) = tracker.update([observe(z, now, covariance_odom_m2=R)], now, camera_at())
        np.testing.assert_allclose(track.position_odom_m, x[:2], atol=1e-9)
        np.testing.assert_allclose(track.velocity_odom_mps, x[2:], atol=1e-9)
        np.testing.assert_allclose(track.covariance_odom, P, atol=1e-9)
