"""The tracker's numbers against filterpy, which has the textbook's Kalman filter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from filterpy.common import Q_continuous_white_noise
from filterpy.kalman import KalmanFilter, predict
from hypothesis import given
from hypothesis import strategies as st
from tracking_scenes import CAMERA, camera_at, observe, white_acceleration

from tracking import PersonTrack, PersonTracker, SensorConfig, TrackerConfig
from tracking.covariances import drifted, matrices

# Without gates.
CONFIG = TrackerConfig(
    gate_probability=1.0 - 1e-12, gate_distance_m=50.0, miss_cost=1e3, confirm_logit=-100.0
)


@given(low=st.floats(0.0, 0.01), extra=st.floats(0.0, 0.01), angle=st.floats(-np.pi, np.pi))
def test_the_noise_floor_raises_eigenvalues_and_keeps_directions(low, extra, angle) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    eigenvalues = np.array([low, low + extra])
    measured_m2 = turn @ np.diag(eigenvalues) @ turn.T
    tracker = PersonTracker()
    seen = observe((3.0, 0.0), 0.0, covariance_odom_m2=measured_m2)
    (track,) = tracker.update([seen], 0.0, camera_at())
    expected = turn @ np.diag(np.maximum(eigenvalues, 0.05**2)) @ turn.T
    np.testing.assert_allclose(track.covariance_odom[:2, :2], expected, atol=1e-9)


@pytest.mark.parametrize("first", range(0, 1000, 250))
def test_the_tracker_is_filterpys_kalman_filter(first: int) -> None:
    """Of a thousand walkers, by two cameras whose frames come one after the other or at once.

    Corrections and predictions are equal to 1e-9.
    """

    def walk(dt_s: float) -> dict[str, Any]:
        density = CONFIG.acceleration_density_m2ps3
        Q = Q_continuous_white_noise(2, dt_s, density, block_size=2, order_by_dim=False)
        return {"F": np.eye(4) + dt_s * np.eye(4, k=2), "Q": Q}

    sensors = {"rear": SensorConfig(measures_range=False, alignment_std_rad=0.0)}
    for seed in range(first, first + 250):
        rng = np.random.default_rng(seed)
        tracker, theirs = PersonTracker(CONFIG, sensors=sensors), KalmanFilter(dim_x=4, dim_z=2)
        theirs.H = np.eye(2, 4)
        place, velocity = rng.uniform(-50.0, 50.0, 2), rng.choice([-1, 1], 2) * rng.uniform(1, 2, 2)
        now = float(rng.uniform(-1e3, 1e3))
        ours, expected = list[PersonTrack](), list[tuple[Any, Any]]()
        for frame in range(8):
            # Two frames at once, and gaps once the person is confirmed, are among them.
            gap_s = rng.uniform(0.2, 1.0 if frame > 3 else 0.3)
            dt_s = float(rng.choice([0.0, *rng.uniform(0.02, 0.2, 3), gap_s]))
            now += dt_s
            place = place + dt_s * velocity
            root = np.diag(rng.uniform(0.06, 0.4, 2)) @ [[c := rng.uniform(), s := 1 - c], [-s, c]]
            R = root.T @ root + 0.05**2 * np.eye(2)
            z = rng.multivariate_normal(place, R)
            if frame == 0:
                theirs.x, theirs.P = np.array([*z, 0.0, 0.0]), np.eye(4)
                theirs.P[:2, :2] = R
            else:
                theirs.predict(**walk(dt_s))
                theirs.update(z, R=R)
            seen = [observe(z, now, covariance_odom_m2=R)]
            (track,) = tracker.update(seen, now, CAMERA, sensor=str(rng.choice(["camera", "rear"])))
            ahead_s = rng.uniform(0.0, 0.5)
            (later,) = tracker.predict(now + ahead_s)
            ours += [track, later]
            expected += [(theirs.x, theirs.P), predict(theirs.x, theirs.P, **walk(ahead_s))]
        states = [[*each.position_odom_m, *each.velocity_odom_mps] for each in ours]
        covariances = [each.covariance_odom for each in ours]
        np.testing.assert_allclose(states, [x for x, _ in expected], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(covariances, [P for _, P in expected], rtol=0.0, atol=1e-9)


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


@pytest.mark.parametrize("seed", range(20))
def test_a_covariance_ahead_is_that_of_constant_velocity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    roots = rng.normal(size=(2, 4, 4))
    given = roots @ roots.transpose(0, 2, 1)
    ahead_s = [0.0, float(rng.uniform(0.0, 3.0))]
    uppers = [tuple(P[np.triu_indices(4)].tolist()) for P in given]
    found = matrices([drifted(upper, dt_s) for upper, dt_s in zip(uppers, ahead_s, strict=True)])
    F, _ = white_acceleration(ahead_s[1], 1.0)
    np.testing.assert_allclose(found, [given[0], F @ given[1] @ F.T], rtol=1e-12, atol=1e-12)
