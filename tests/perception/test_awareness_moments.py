"""Awareness against its definition: the moments of the score over errors that are drawn."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_people import FACING, awareness_of

from perception import AttentionCone, HeadPose
from perception.anthropometry import EYES_HEAD_M
from perception.arrays import FloatArray
from perception.awareness import estimate_awareness
from perception.eyes import EyeGaze

CONE = AttentionCone()
DRAWS = 20_000
EYE_STD_RAD = (0.12, 0.06)


def some_head(rng: np.random.Generator) -> HeadPose:
    """Return a head that looks roughly at the camera, with correlated errors."""
    rotation = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3)).as_matrix() @ FACING
    root = rng.normal(0.0, 1.0, (6, 6)) * np.array([0.05] * 3 + [0.03] * 3)[:, None]
    position = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(1.0, 2.0)])
    return HeadPose(position, rotation, root @ root.T / 3.0, 0.0)


def scores(apex: FloatArray, turn: Rotation, axes: FloatArray, points: FloatArray) -> FloatArray:
    """Return the score of each draw, for the point of the robot with the highest one."""
    gaze, up = turn.apply(axes[:, 1]), turn.apply(-axes[:, 0])
    return np.max([CONE.scores(apex, gaze, point, up) for point in points], axis=0)


def by_drawing(
    rng: np.random.Generator,
    head: HeadPose,
    points: FloatArray,
    extra_std_rad: float,
    seen: float,
    eyes: EyeGaze | None,
) -> tuple[float, float]:
    """Return α and its standard deviation, of a person whose eyes turn in the head."""
    errors = rng.multivariate_normal(np.zeros(6), head.covariance, DRAWS)
    small = Rotation.from_rotvec(errors[:, :3])
    apex = head.position_camera_m + errors[:, 3:]
    apex = apex + small.apply(head.rotation_camera_head @ EYES_HEAD_M)
    axes = head.rotation_camera_head.copy()
    if eyes is not None:
        axes = axes @ eyes.rotation_head_eyes
        yaw, pitch = rng.multivariate_normal(np.zeros(2), eyes.covariance_rad2, DRAWS).T
        known = yaw[:, None] * -axes[:, 0] + pitch[:, None] * axes[:, 2]
        small = small * Rotation.from_rotvec(known)
    more = Rotation.from_rotvec(extra_std_rad * rng.normal(size=(DRAWS, 2)) @ axes[:, ::2].T)
    measured = scores(apex, more * small, axes, points)
    true = measured
    if eyes is None:
        turned = rng.normal(size=(DRAWS, 2)) * EYE_STD_RAD @ axes[:, ::2].T
        true = scores(apex, more * small * Rotation.from_rotvec(turned), axes, points)
    nominal = scores(
        head.position_camera_m + head.rotation_camera_head @ EYES_HEAD_M,
        Rotation.identity(),
        axes,
        points,
    )
    alpha = seen * min(float(nominal), measured.mean())
    return alpha, float(np.sqrt(seen * np.mean((true - alpha) ** 2) + (1.0 - seen) * alpha**2))


@pytest.mark.parametrize("with_eyes", [False, True])
@pytest.mark.parametrize("count", [1, 3])
def test_awareness_is_the_moments_of_the_score(with_eyes: bool, count: int) -> None:
    rng = np.random.default_rng(3 + count)
    points = rng.normal(0.0, 0.15, (count, 3))
    heads = [some_head(rng) for _ in range(8)]
    extra, seen = rng.uniform(0.0, 0.15, 8), rng.uniform(0.6, 1.0, 8)
    root = rng.normal(0.0, 0.08, (8, 2, 2))
    eyes = [
        EyeGaze(rng.uniform(-0.3, 0.3, 2), each @ each.T) if with_eyes and row % 2 else None
        for row, each in enumerate(root)
    ]
    found = estimate_awareness(
        CONE,
        heads,
        points,
        extra_std_rad=extra,
        eye_in_head_std_rad=EYE_STD_RAD,
        face_seen=seen,
        eyes=eyes,
    )
    for row, head in enumerate(heads):
        drawn = by_drawing(rng, head, points, extra[row], seen[row], eyes[row])
        pair = found[row].awareness, found[row].awareness_std
        assert pair == pytest.approx(drawn, abs=0.012), row


def test_errors_that_turn_head_and_place_together_about_the_robot_cost_nothing() -> None:
    """A turn about the camera moves gaze and line of sight alike, so the angle between them stays.

    The signs of what a turn does to the gaze, to the eyes' place and to the line of sight must fit.
    """
    place = np.array([0.3, -0.2, 0.6])
    for axis, yaw in product(np.eye(3), (0.0, 0.5, -0.8)):
        rotation = Rotation.from_euler("y", yaw).as_matrix() @ FACING
        turn = np.concatenate([axis, np.cross(axis, place)])
        covariance = 0.05**2 * np.outer(turn, turn) + 1e-12 * np.eye(6)
        alpha, std = awareness_of(HeadPose(place, rotation, covariance, 0.0))
        nominal = CONE.score(
            place + rotation @ EYES_HEAD_M, rotation[:, 1], np.zeros(3), -rotation[:, 0]
        )
        assert alpha == pytest.approx(nominal, abs=1e-3)
        assert std < 2e-3
