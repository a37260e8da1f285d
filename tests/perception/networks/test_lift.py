"""Lifting: skeletons in metres from pixels and depths."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from perception import Camera, PersonKeypoints
from perception.anthropometry import LIMBS
from perception.body import place_bodies
from perception.networks.poses import lift_keypoints, metres_per_pixel

FOCAL_PX = 500.0
FAR_M = 200.0  # weak perspective holds
DOWN, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0])


def body(yaw_rad: float = 0.0) -> np.ndarray:
    """Return a body (17, 3) relative to the mid-hip; every limb has the average length."""
    points = np.zeros((17, 3))
    length = {limb.name: limb.length_m for limb in LIMBS}
    for side, sign in ((0, 1.0), (1, -1.0)):
        shoulder = np.array([sign * 0.5 * length["shoulder span"], -length["torso"], 0.0])
        elbow = shoulder + length["left upper arm"] * DOWN
        hip = np.array([sign * 0.5 * length["hip span"], 0.0, 0.0])
        knee = hip + length["left thigh"] * DOWN
        points[5 + side], points[7 + side] = shoulder, elbow
        points[9 + side] = elbow + length["left forearm"] * AHEAD
        points[11 + side], points[13 + side] = hip, knee
        points[15 + side] = knee + length["left shank"] * DOWN
    points[:5] = points[5:7].mean(axis=0) - 0.2 * DOWN + 0.1 * AHEAD
    return Rotation.from_euler("y", yaw_rad).apply(points)


@pytest.mark.parametrize("yaw_deg", [0, 30, 60, 90, 180, 250])
def test_a_distant_body_is_recovered_at_any_heading(yaw_deg: float) -> None:
    points = body(math.radians(yaw_deg))
    pixels = points[:, :2] * FOCAL_PX / FAR_M + (320.0, 240.0)
    skeleton = lift_keypoints(pixels[None], points[None, :, 2], np.ones((1, 17)))[0]
    np.testing.assert_allclose(skeleton, points, atol=1e-9)


def test_without_depths_the_skeleton_is_flat_and_has_the_right_scale() -> None:
    points = body(math.radians(40))
    pixels = points[:, :2] * FOCAL_PX / FAR_M
    skeleton = lift_keypoints(pixels[None], None, np.ones((1, 17)))[0]
    assert (skeleton[:, 2] == 0.0).all()
    np.testing.assert_allclose(skeleton[:, :2], points[:, :2], atol=1e-9)


def test_limbs_that_point_at_the_camera_and_an_outlier_do_not_affect_the_scale() -> None:
    points = body()
    points[9, :2] += (0.5, 0.5)  # a wrist at a wrong place
    pixels = points[None, :, :2] * FOCAL_PX / FAR_M
    scale = metres_per_pixel(pixels, points[None, :, 2], np.ones((1, 17)))
    assert scale[0] == pytest.approx(FAR_M / FOCAL_PX)


def test_unseen_limbs_vote_only_if_no_limb_is_seen() -> None:
    points = body()
    pixels = points[None, :, :2] * FOCAL_PX / FAR_M
    wrong = pixels.copy()
    wrong[:, 11:] *= 3.0  # unseen legs, three times too large
    scores = np.ones((1, 17))
    scores[:, 11:] = 0.1
    shown = metres_per_pixel(wrong, points[None, :, 2], scores)
    assert shown[0] == pytest.approx(FAR_M / FOCAL_PX)
    guessed = metres_per_pixel(pixels, points[None, :, 2], np.zeros((1, 17)))
    assert guessed[0] == pytest.approx(FAR_M / FOCAL_PX)


@pytest.mark.parametrize("yaw_deg", [0, 45, 110])
@pytest.mark.parametrize("distance_m", [2.0, 4.0])
def test_the_pipeline_places_a_lifted_body(distance_m: float, yaw_deg: float) -> None:
    """At short distances weak perspective causes an error of some percent."""
    camera = Camera.from_fov(640, 480, math.radians(60.0))
    points = body(math.radians(yaw_deg))
    root = np.array([0.2, 0.1, distance_m])
    pixels = camera.project(points + root)
    true = root + 0.7 * points[5:7].mean(axis=0)
    for depths, limit in ((points[None, :, 2], 0.06), (None, 0.12)):
        skeleton = lift_keypoints(pixels[None], depths, np.ones((1, 17)))[0]
        found = place_bodies(camera, [PersonKeypoints(pixels, skeleton, np.ones(17), "coco")], 1.0)[
            0
        ]
        assert found is not None
        assert np.linalg.norm(found.position_camera_m - true) < limit * distance_m
