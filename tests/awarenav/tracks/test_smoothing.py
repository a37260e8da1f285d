"""Smoothed tracks: against the joint least squares of all measurements, and closer to the truth."""

from __future__ import annotations

import numpy as np

from awarenav.tracks._smoothing import smooth
from perception import PersonObservation
from perception.arrays import FloatArray
from tracking import PersonTracker, TrackerConfig

CONFIG = TrackerConfig()
STD_M = 0.1
# Of a sensor whose frame is odom.
SENSOR = np.eye(4)


def observe(place_m: FloatArray, stamp_s: float) -> PersonObservation:
    spread_m2 = STD_M**2 * np.eye(3)
    return PersonObservation(stamp_s, [*place_m, 0.0], spread_m2, None, None, None, 0.9)


def white_acceleration(dt_s: float, density_m2ps3: float) -> tuple[FloatArray, FloatArray]:
    """Return F and Q of constant velocity under white acceleration."""
    F = np.eye(4) + dt_s * np.eye(4, k=2)
    place, cross = dt_s**3 / 3.0, dt_s**2 / 2.0
    return F, density_m2ps3 * np.kron([[place, cross], [cross, dt_s]], np.eye(2))


def tracked(
    stamps_s: FloatArray, measured_m: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stamps, states and covariances of the one track, from its first frame on."""
    tracker = PersonTracker(CONFIG)
    states, covariances = [], []
    for stamp_s, place in zip(stamps_s.tolist(), measured_m, strict=True):
        seen = [] if np.isnan(place[0]) else [observe(place, stamp_s)]
        (track,) = tracker.update(seen, stamp_s, SENSOR)
        states.append(np.concatenate([track.position_odom_m, track.velocity_odom_mps]))
        covariances.append(track.covariance_odom)
    return stamps_s, np.array(states), np.array(covariances)


def walk_along(seed: int, count: int = 60) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stamps, states of white acceleration, and measured places."""
    rng = np.random.default_rng(seed)
    stamps_s = np.cumsum(rng.uniform(0.04, 0.12, count))
    truth = np.empty((count, 4))
    truth[0] = 4.0, 1.0, 0.8, -0.5
    for row, dt_s in enumerate(np.diff(stamps_s), start=1):
        F, Q = white_acceleration(round(float(dt_s), 9), CONFIG.acceleration_density_m2ps3)
        truth[row] = F @ truth[row - 1] + np.linalg.cholesky(Q) @ rng.normal(size=4)
    return stamps_s, truth, truth[:, :2] + STD_M * rng.normal(size=(count, 2))


def test_the_path_is_the_least_squares_of_all_measurements() -> None:
    """One linear system of all states at once: the prior, the steps and the places."""
    stamps_s, _, measured_m = walk_along(3, 20)
    stamps_s, states, covariances = tracked(stamps_s, measured_m)
    path = smooth(stamps_s, states, covariances, CONFIG)
    count = len(stamps_s)
    information, target = np.zeros((4 * count, 4 * count)), np.zeros(4 * count)
    prior = np.diag([STD_M**-2] * 2 + [1.0] * 2)
    information[:4, :4] += prior
    target[:4] += prior @ [*measured_m[0], 0.0, 0.0]
    for row in range(1, count):
        F, Q = white_acceleration(
            float(stamps_s[row] - stamps_s[row - 1]), CONFIG.acceleration_density_m2ps3
        )
        step = np.hstack([-F, np.eye(4)])
        rows = slice(4 * row - 4, 4 * row + 4)
        information[rows, rows] += step.T @ np.linalg.solve(Q, step)
        information[4 * row : 4 * row + 2, 4 * row : 4 * row + 2] += np.eye(2) / STD_M**2
        target[4 * row : 4 * row + 2] += measured_m[row] / STD_M**2
    joint = np.linalg.solve(information, target).reshape(count, 4)
    np.testing.assert_allclose(path.states, joint, atol=1e-6)
    blocks = np.linalg.inv(information)
    np.testing.assert_allclose(path.covariances[7], blocks[28:32, 28:32], atol=1e-6)


def test_the_path_is_closer_to_the_truth_than_the_track_and_ends_where_it_ends() -> None:
    errors = []
    for seed in range(2):
        stamps_s, truth, measured_m = walk_along(seed)
        measured_m[20:26] = np.nan
        stamps_s, states, covariances = tracked(stamps_s, measured_m)
        path = smooth(stamps_s, states, covariances)
        errors.append(
            [np.linalg.norm(each - truth, axis=1).mean() for each in (states, path.states)]
        )
        np.testing.assert_array_equal(path.states[-1], states[-1])
        assert (np.linalg.eigvalsh(path.covariances) > 0.0).all()
    track, smoothed = np.mean(errors, axis=0)
    assert smoothed < 0.7 * track


def test_places_between_and_outside_the_stamps() -> None:
    stamps_s, states, covariances = tracked(*walk_along(1)[::2])
    path = smooth(stamps_s, states, covariances)
    middle = path.places_m(np.array([0.5 * (stamps_s[4] + stamps_s[5])]))
    np.testing.assert_allclose(middle[0], path.states[4:6, :2].mean(axis=0))
    assert np.isnan(path.places_m(np.array([stamps_s[0] - 0.01, stamps_s[-1] + 0.01]))).all()
    alone = smooth(stamps_s[:1], states[:1], covariances[:1])
    np.testing.assert_array_equal(alone.states, states[:1])
