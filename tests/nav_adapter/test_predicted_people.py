"""People over the horizon with their covariance: against sampling and the adapter's own numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from nav_scenes import ROBOT, crowds, finite, person, robot_at

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError, PersonObstacle
from nav_adapter._people import position_sigma_m
from nav_adapter.exporters import predicted_circles, predicted_people
from tracking import PersonTrack
from tracking.prediction import PredictionModel

TIMES_S = np.array([0.0, 0.4, 1.0, 3.0])


def constraints_for(tracks: tuple[PersonTrack, ...], now: float = 0.0) -> NavConstraints:
    return NavAdapter(AwarenessPolicy(), ROBOT).update(tracks, robot_at(now), now)


@given(tracks=crowds())
def test_means_are_those_of_the_circles_and_covariances_are_valid(
    tracks: tuple[PersonTrack, ...],
) -> None:
    constraints = constraints_for(tracks)
    people = predicted_people(constraints, TIMES_S)
    assert people.means_odom_m.shape == (len(tracks), 4, 2)
    assert people.covariances_odom_m2.shape == (len(tracks), 4, 2, 2)
    circles = predicted_circles(constraints, TIMES_S)
    np.testing.assert_array_equal(people.means_odom_m, circles[:, :, :2])
    transposed = np.swapaxes(people.covariances_odom_m2, -1, -2)
    np.testing.assert_allclose(people.covariances_odom_m2, transposed, atol=1e-12)
    assert (np.linalg.eigvalsh(people.covariances_odom_m2) > -1e-9).all()


def with_white_acceleration(density_m2ps3: float) -> PredictionModel:
    """Return constant velocity with white acceleration and nothing else."""
    return PredictionModel(
        lag_per_s2=0.0,
        acceleration_density_m2ps3=density_m2ps3,
        change_mps=0.0,
        slow_change_mps=0.0,
        sway_s=0.0,
        max_speed_mps=15.0,
        max_acceleration_mps2=50.0,
    )


@given(tracks=crowds(), t_s=finite(0.0, 3.0))
def test_the_largest_deviation_is_that_of_the_adapter(
    tracks: tuple[PersonTrack, ...], t_s: float
) -> None:
    """The adapter predicts the track from its own stamp, in plain Python."""
    now = constraints_for(tracks)
    people = predicted_people(now, [t_s], model=with_white_acceleration(0.0))
    by_id = sorted(tracks, key=lambda track: track.id)
    for track, covariances in zip(by_id, people.covariances_odom_m2, strict=True):
        variance = position_sigma_m(track, t_s - track.stamp_s) ** 2
        largest = float(np.linalg.eigvalsh(covariances[0])[-1])
        assert largest == pytest.approx(variance, abs=1e-9)


def test_the_covariance_is_that_of_sampled_walks() -> None:
    """Positions after steps of constant velocity with white acceleration, from the track's own."""
    rng = np.random.default_rng(4)
    root = np.array([[0.2, 0, 0, 0], [0.05, 0.15, 0, 0], [0.1, 0, 0.3, 0], [0, 0.1, 0.05, 0.2]])
    track = PersonTrack(
        id=1,
        stamp_s=-0.2,
        status="confirmed",
        position_odom_m=[3.0, 1.0],
        velocity_odom_mps=[-0.5, 0.3],
        covariance_odom=root @ root.T,
        awareness=0.5,
        awareness_std=0.1,
        awareness_lower=0.3,
        height_m=1.7,
        time_since_seen_s=0.0,
    )
    density, count, step_s, horizon_s = 0.1, 40_000, 0.02, 1.5
    state = np.array([3.0, 1.0, -0.5, 0.3]) + rng.normal(size=(count, 4)) @ root.T
    state[:, :2] += 0.2 * state[:, 2:]
    for _ in range(round(horizon_s / step_s)):
        kick = rng.normal(0.0, math.sqrt(density * step_s), (count, 2))
        state[:, :2] += step_s * (state[:, 2:] + 0.5 * kick)
        state[:, 2:] += kick
    model = with_white_acceleration(density)
    people = predicted_people(constraints_for((track,)), [horizon_s], model=model)
    np.testing.assert_allclose(people.means_odom_m[0, 0], state[:, :2].mean(axis=0), atol=0.02)
    np.testing.assert_allclose(
        people.covariances_odom_m2[0, 0], np.cov(state[:, :2].T), rtol=0.04, atol=0.01
    )


def test_the_covariance_grows_with_time() -> None:
    people = predicted_people(constraints_for((person(sigma_m=0.1),)), TIMES_S)
    trace = np.trace(people.covariances_odom_m2[0], axis1=1, axis2=2)
    assert trace[0] == pytest.approx(2 * 0.1**2)
    assert (np.diff(trace) > 0.0).all()


def test_obstacles_keep_a_read_only_covariance_at_the_stamp() -> None:
    (obstacle,) = constraints_for((person(sigma_m=0.2),), 0.1).obstacles
    assert obstacle.covariance_odom is not None
    np.testing.assert_allclose(obstacle.covariance_odom, np.diag([0.04, 0.04, 0.0, 0.0]))
    with pytest.raises(ValueError, match="read-only"):
        obstacle.covariance_odom[0, 0] = 1.0
    assert "covariance" not in repr(obstacle)


def test_what_is_not_known_is_refused() -> None:
    (known,) = constraints_for((person(),)).obstacles
    made = PersonObstacle(
        1, known.center_odom_m, (0.0, 0.0), known.radius_m, 1.7, 0.0, known.polygon
    )
    with pytest.raises(NavError, match=r"obstacles\[0\] has covariance_odom=None"):
        predicted_people(NavConstraints(0.0, (made,), 1.0, "a test", False), TIMES_S)
    nobody = predicted_people(NavConstraints(0.0, (), 1.0, "a test", False), TIMES_S)
    assert nobody.means_odom_m.shape == (0, 4, 2)
    assert nobody.covariances_odom_m2.shape == (0, 4, 2, 2)
    with pytest.raises(NavError, match="times_s"):
        predicted_people(constraints_for(()), [-0.1])
    with pytest.raises(NavError, match="covariance_odom"):
        PersonObstacle(1, (0, 0), (0, 0), 0.5, 1.7, 0.0, known.polygon, -np.eye(4))
