"""A moving camera with an uncertain pose."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import chi2
from tracking_scenes import CAMERA, PERIOD_S, FloatArray, camera_at, nearest, observe

from tracking import PersonTrack, PersonTracker, TrackerConfig, TrackingError

LOOSE = TrackerConfig(position_noise_floor_m=1e-3)
POSE = np.array([[0.01, 0.002, 0.001], [0.002, 0.02, -0.002], [0.001, -0.002, 0.0009]])


def first_sight(
    place_m: tuple[float, float], T: FloatArray, pose: FloatArray | None
) -> PersonTrack:
    seen = [observe(place_m, 0.0, T_odom_camera=T, covariance_odom_m2=1e-4)]
    (track,) = PersonTracker(LOOSE).update(seen, 0.0, T, pose_covariance_odom=pose)
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
    expected = np.cov(sampled.T) + 1e-4 * np.eye(2)
    np.testing.assert_allclose(covariance[:2, :2], expected, rtol=0.04, atol=4e-4)


@pytest.mark.parametrize("range_m", [1.0, 2.0, 4.0, 8.0])
def test_an_error_in_yaw_moves_people_sideways_in_proportion_to_range(range_m: float) -> None:
    pose = np.diag([0.0, 0.0, 0.02**2])
    covariance = first_sight((range_m, 0.0), CAMERA, pose).covariance_odom
    assert covariance[0, 0] == pytest.approx(1e-4)
    assert covariance[1, 1] == pytest.approx(1e-4 + (0.02 * range_m) ** 2)


def test_a_pose_covariance_of_zero_adds_nothing() -> None:
    with_zero = first_sight((3.0, 1.0), CAMERA, np.zeros((3, 3)))
    np.testing.assert_allclose(
        with_zero.covariance_odom,
        first_sight((3.0, 1.0), CAMERA, None).covariance_odom,
        atol=1e-15,
    )


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        (np.eye(2), r"pose_covariance_odom must have shape \(3, 3\), got \(2, 2\)"),
        (np.diag([1.0, 1.0, -1.0]), "pose_covariance_odom must be positive semi-definite"),
        (np.diag([1.0, 1.0, np.nan]), "pose_covariance_odom must be finite"),
        (np.diag([1e200, 1.0, 1.0]), "the pose's share included"),
    ],
)
def test_a_matrix_that_is_not_a_covariance_is_refused(pose: FloatArray, message: str) -> None:
    tracker = PersonTracker()
    with pytest.raises(TrackingError, match=message):
        tracker.update([observe((3, 0), 0.0)], 0.0, CAMERA, pose_covariance_odom=pose)
    assert tracker.last_stamp_s is None


def figure_of_eight(now: float) -> FloatArray:
    """Return the pose of a camera on a figure of eight, 3 m by 1.5 m in 12 s, looking ahead."""
    phase = 2.0 * math.pi * now / 12.0
    x, y = 1.5 * math.sin(phase), 0.75 * math.sin(2.0 * phase)
    yaw = math.atan2(1.5 * math.cos(2.0 * phase), 1.5 * math.cos(phase))
    return camera_at(x, y, yaw, 0.05 * math.sin(9.0 * now))


def test_a_camera_in_a_figure_of_eight_gives_the_tracks_of_a_fixed_one() -> None:
    """Each camera has its own noise, the moving one also pose errors: equal within covariance."""
    rng = np.random.default_rng(12)
    starts = np.array([[4.0, -3.0], [-4.0, 2.0], [3.0, 3.0], [-3.0, -3.0]])
    velocities = np.array([[-0.3, 0.6], [0.7, 0.0], [0.0, 0.0], [0.0, 0.0]])
    fixed, moving = PersonTracker(), PersonTracker()
    pose = np.diag([0.02, 0.02, 0.005]) ** 2
    distances = []
    for step in range(240):
        now = step * PERIOD_S
        places = starts + velocities * now
        still = [observe(p + rng.normal(0.0, 0.1, 2), now) for p in places]
        seen_fixed = fixed.update(still, now, CAMERA)
        T = figure_of_eight(now)
        error = rng.multivariate_normal(np.zeros(3), pose)
        c, s = math.cos(error[2]), math.sin(error[2])
        turn = np.array([[c, -s], [s, c]])
        measured = [
            T[:2, 3] + error[:2] + turn @ (p + rng.normal(0.0, 0.1, 2) - T[:2, 3]) for p in places
        ]
        seen_moving = moving.update(
            [observe(p, now, T_odom_camera=T) for p in measured], now, T, pose_covariance_odom=pose
        )
        if step % 40 == 39:
            # One measurement in 300 is outside its gate and starts a track that is soon deleted.
            confirmed = [
                [t for t in seen if t.status != "tentative"] for seen in (seen_fixed, seen_moving)
            ]
            assert [len(tracks) for tracks in confirmed] == [4, 4]
            for place in places:
                a, b = nearest(confirmed[0], place), nearest(confirmed[1], place)
                assert a.id == b.id <= 4
                state_a = np.concatenate([a.position_odom_m, a.velocity_odom_mps])
                state_b = np.concatenate([b.position_odom_m, b.velocity_odom_mps])
                spread = a.covariance_odom + b.covariance_odom
                distances.append((state_a - state_b) @ np.linalg.solve(spread, state_a - state_b))
    # Straight walkers deviate less than the filter expects, so there is only an upper bound.
    assert np.sum(distances) < chi2.ppf(0.995, df=4 * len(distances))
    assert max(distances) < chi2.ppf(0.9999, df=4)
