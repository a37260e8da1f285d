"""Frames of reference: the motion of the camera, its pose errors and the choice of odom."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, camera_at, observe

from tracking import PersonTrack, PersonTracker

NOISE_M2 = np.array([[0.01, 0.004], [0.004, 0.03]])


def crowd(
    camera_of: Callable[[float], FloatArray], world: FloatArray | None = None
) -> tuple[PersonTrack, ...]:
    """Return the tracks of three walkers, one of them hidden for a while, after two seconds.

    ``world`` (4, 4) rotates and shifts odom while the camera images stay the same.
    """
    rng = np.random.default_rng(5)
    starts = np.array([[3.0, -1.0], [4.0, 1.5], [6.0, 0.0]])
    velocities = np.array([[0.2, 1.1], [-0.8, -0.5], [-1.0, 0.3]])
    shift = np.eye(4) if world is None else world
    tracker, tracks = PersonTracker(), ()
    for step in range(40):
        now = step * PERIOD_S
        T = camera_of(now)
        noise = rng.normal(size=(3, 2)) @ np.linalg.cholesky(NOISE_M2).T
        observations = [
            observe(
                place,
                now,
                T_odom_camera=T,
                covariance_odom_m2=NOISE_M2,
                awareness=alpha,
                awareness_std=0.06,
            )
            for index, (place, alpha) in enumerate(
                zip(starts + velocities * now + noise, (0.9, 0.1, None), strict=True)
            )
            if index != 1 or not 20 <= step < 34
        ]
        tracks = tracker.update(observations, now, shift @ T)
    return tracks


def moving_camera(now: float) -> FloatArray:
    return camera_at(0.8 * now, -0.2 * now, 0.4 * now, 0.1 + 0.05 * math.sin(9.0 * now))


def assert_same(
    first: tuple[PersonTrack, ...], second: tuple[PersonTrack, ...], world: FloatArray | None = None
) -> None:
    T = np.eye(4) if world is None else world
    R, t = T[:2, :2], T[:2, 3]
    turn = np.kron(np.eye(2), R)
    assert [(a.id, a.status) for a in first] == [(b.id, b.status) for b in second]
    assert len(first) == 3
    for a, b in zip(first, second, strict=True):
        np.testing.assert_allclose(b.position_odom_m, R @ a.position_odom_m + t, atol=1e-8)
        np.testing.assert_allclose(b.velocity_odom_mps, R @ a.velocity_odom_mps, atol=1e-8)
        np.testing.assert_allclose(b.covariance_odom, turn @ a.covariance_odom @ turn.T, atol=1e-8)
        assert b.awareness == pytest.approx(a.awareness, abs=1e-12)
        assert b.awareness_lower == pytest.approx(a.awareness_lower, abs=1e-12)


def test_a_moving_camera_gives_the_tracks_of_a_fixed_one() -> None:
    assert_same(crowd(lambda _: camera_at()), crowd(moving_camera))


def test_standing_people_have_no_velocity_however_the_camera_moves() -> None:
    tracker = PersonTracker()
    for step in range(60):
        now = step * PERIOD_S
        T = moving_camera(now)
        tracks = tracker.update([observe((3.0, 0.5), now, T_odom_camera=T)], now, T)
    np.testing.assert_allclose(tracks[0].position_odom_m, (3.0, 0.5), atol=1e-9)
    np.testing.assert_allclose(tracks[0].velocity_odom_mps, (0.0, 0.0), atol=1e-9)


@settings(max_examples=10)
@given(x_m=st.floats(-100.0, 100.0), y_m=st.floats(-100.0, 100.0), yaw=st.floats(-math.pi, math.pi))
def test_rotating_and_shifting_the_world_rotates_and_shifts_the_tracks(
    x_m: float, y_m: float, yaw: float
) -> None:
    world = np.eye(4)
    world[:2, :2] = [[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]
    world[:3, 3] = x_m, y_m, 0.3
    assert_same(crowd(moving_camera), crowd(moving_camera, world), world)


SEEN_M2 = 0.06**2
POSE = np.array([[0.01, 0.002, 0.001], [0.002, 0.02, -0.002], [0.001, -0.002, 0.0009]])


def first_sight(
    place_m: tuple[float, float], T: FloatArray, pose: FloatArray | None
) -> PersonTrack:
    seen = [observe(place_m, 0.0, T_odom_camera=T, covariance_odom_m2=SEEN_M2)]
    (track,) = PersonTracker().update(seen, 0.0, T, pose_covariance_odom=pose)
    return track


@pytest.mark.parametrize("yaw_rad", [0.0, 0.7, -2.0])
def test_an_uncertain_pose_adds_the_covariance_of_a_monte_carlo_run(yaw_rad: float) -> None:
    rng = np.random.default_rng(0)
    camera_m = np.array([1.0, -2.0])
    ahead = np.array([math.cos(yaw_rad), math.sin(yaw_rad)])
    place = camera_m + 4.0 * ahead
    covariance = first_sight(tuple(place), camera_at(*camera_m, yaw_rad), POSE).covariance_odom
    errors = rng.multivariate_normal(np.zeros(3), POSE, 40_000)
    turned = np.array([[0.0, -1.0], [1.0, 0.0]]) @ (place - camera_m)
    # The camera reports the same position in its own frame, whatever its true pose.
    c, s = np.cos(errors[:, 2:]), np.sin(errors[:, 2:])
    sampled = camera_m + errors[:, :2] + c * (place - camera_m) + s * turned
    expected = np.cov(sampled.T) + SEEN_M2 * np.eye(2)
    np.testing.assert_allclose(covariance[:2, :2], expected, rtol=0.04, atol=4e-4)


@pytest.mark.parametrize("range_m", [1.0, 2.0, 4.0, 8.0])
def test_an_error_in_yaw_moves_people_sideways_in_proportion_to_range(range_m: float) -> None:
    pose = np.diag([0.0, 0.0, 0.02**2])
    covariance = first_sight((range_m, 0.0), CAMERA, pose).covariance_odom
    assert covariance[0, 0] == pytest.approx(SEEN_M2)
    assert covariance[1, 1] == pytest.approx(SEEN_M2 + (0.02 * range_m) ** 2)
