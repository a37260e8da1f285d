"""Frames of reference: the motion of the camera, its pose errors and the choice of odom."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from tracking_scenes import PERIOD_S, FloatArray, camera_at, observe

from tracking import PersonTrack, PersonTracker

NOISE_M2 = np.array([[0.01, 0.004], [0.004, 0.03]])


def crowd(camera_of: Callable[[float], FloatArray]) -> tuple[PersonTrack, ...]:
    """Return the tracks of three walkers, one of them hidden for a while, after two seconds."""
    rng = np.random.default_rng(5)
    starts = np.array([[3.0, -1.0], [4.0, 1.5], [6.0, 0.0]])
    velocities = np.array([[0.2, 1.1], [-0.8, -0.5], [-1.0, 0.3]])
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
        tracks = tracker.update(observations, now, T)
    return tracks


def moving_camera(now: float) -> FloatArray:
    return camera_at(0.8 * now, -0.2 * now, 0.4 * now, 0.1 + 0.05 * math.sin(9.0 * now))


def test_a_moving_camera_gives_the_tracks_of_a_fixed_one() -> None:
    fixed, moving = crowd(lambda _: camera_at()), crowd(moving_camera)
    assert [(a.id, a.status) for a in fixed] == [(b.id, b.status) for b in moving]
    assert len(fixed) == 3
    for a, b in zip(fixed, moving, strict=True):
        for name in ("position_odom_m", "velocity_odom_mps", "covariance_odom"):
            np.testing.assert_allclose(getattr(b, name), getattr(a, name), atol=1e-8)
        assert b.awareness == pytest.approx(a.awareness, abs=1e-12)
        assert b.awareness_lower == pytest.approx(a.awareness_lower, abs=1e-12)


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
