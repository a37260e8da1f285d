"""The tracker's numbers against plain numpy: a textbook Kalman filter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import CAMERA, camera_at, observe, white_acceleration

from tracking import PersonTracker, SensorConfig, TrackerConfig

# Without gates and without standing people.
CONFIG = TrackerConfig(
    gate_probability=1.0 - 1e-12,
    gate_distance_m=50.0,
    miss_cost=1e3,
    standing_speed_mps=0.0,
    position_noise_floor_m=0.01,
    confirm_logit=-100.0,
)
NOISE_M2 = np.array([[0.02, 0.008], [0.008, 0.05]])


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
    """Of two cameras whose frames come one after the other or at once."""
    rng = np.random.default_rng(3)
    rear = SensorConfig(measures_range=False, miss_cost=1e3, alignment_std_rad=0.0)
    tracker = PersonTracker(CONFIG, sensors={"rear": rear})
    H = np.eye(2, 4)
    now, x, P = 0.0, np.zeros(4), np.zeros((4, 4))
    for frame in range(40):
        dt_s = float(rng.choice([0.0, 0.03, 0.05, 0.4]))
        now += dt_s
        R = NOISE_M2 * rng.uniform(0.1, 2.0)
        sensor = "camera" if rng.uniform() < 0.5 else "rear"
        z = np.array([2.0 + 1.2 * now, -0.3 * now]) + np.linalg.cholesky(R) @ rng.normal(size=2)
        if frame == 0:
            x, P = np.array([*z, 0.0, 0.0]), np.diag([0.0, 0.0, 1.0, 1.0])
            P[:2, :2] = R
        else:
            F, Q = white_acceleration(dt_s, CONFIG.acceleration_density_m2ps3)
            x, P = F @ x, F @ P @ F.T + Q
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            x, P = x + K @ (z - H @ x), (np.eye(4) - K @ H) @ P
        seen = [observe(z, now, covariance_odom_m2=R)]
        (track,) = tracker.update(seen, now, camera_at(), sensor=sensor)
        np.testing.assert_allclose(track.position_odom_m, x[:2], atol=1e-9)
        np.testing.assert_allclose(track.velocity_odom_mps, x[2:], atol=1e-9)
        np.testing.assert_allclose(track.covariance_odom, P, atol=1e-9)


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


@pytest.mark.parametrize("ahead_s", [0.4, 0.9, 2.4])
def test_the_velocity_of_somebody_who_stood_dies_away_once_they_are_unseen(ahead_s: float) -> None:
    """For half a second as of anybody, then with a time constant of 1 s: an Ornstein walk."""
    tracker = PersonTracker()
    for step in range(40):
        now = 0.05 * step
        (track,) = tracker.update([observe((4.0, 0.002 * step), now)], now, camera_at())
    (later,) = tracker.predict(now + ahead_s)
    state = np.concatenate([track.position_odom_m, track.velocity_odom_mps])
    covariance = track.covariance_odom
    for dt_s, per_s in ((min(ahead_s, 0.5), 0.0), (max(ahead_s - 0.5, 0.0), 1.0)):
        F, Q = white_acceleration(dt_s, 0.05, per_s)
        state, covariance = F @ state, F @ covariance @ F.T + Q
    np.testing.assert_allclose(later.position_odom_m, state[:2], atol=1e-9)
    np.testing.assert_allclose(later.velocity_odom_mps, state[2:], atol=1e-9)
    np.testing.assert_allclose(later.covariance_odom, covariance, rtol=1e-6, atol=1e-9)
