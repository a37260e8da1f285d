"""Placement of bodies and boxes in the camera frame, and the scale of skeletons."""

import math

import numpy as np
import pytest
from synthetic_people import person_at

from perception import Camera, PersonKeypoints
from perception.anthropometry import MEAN_STATURE_M
from perception.body import place_bodies, place_boxes

CAMERA = Camera.from_fov(1280, 960, math.radians(60.0))


def scale_of(person):
    """Return the factor from the skeleton's unit to metres."""
    placed = place_bodies(CAMERA, (person,), 1.0)[0].keypoints_camera_m
    return np.ptp(placed[:, 1]) / np.ptp(person.keypoints_root_m[:, 1])


def inside(person):
    u, v = person.keypoints_px.T
    seen = (u >= 0) & (u < CAMERA.width_px) & (v >= 0) & (v < CAMERA.height_px)
    return PersonKeypoints(
        person.keypoints_px, person.keypoints_root_m, seen.astype(float), person.layout
    )


def relative_errors(*, lift_std_m, unit, stature_m=1.74, count=200, seed=0):
    """Return errors at 2–8 m and every heading, with only a part of the body in some images."""
    rng = np.random.default_rng(seed)
    errors = []
    for _ in range(count):
        depth = rng.uniform(2.0, 8.0)
        person = person_at(
            (rng.uniform(-0.4, 0.4) * depth, 0.45, depth),
            body_yaw_rad=rng.uniform(-math.pi, math.pi),
            stature_m=stature_m,
        )
        seen = person.keypoints(CAMERA, 1.0, rng, lift_std_m=lift_std_m, unit=unit)
        body = place_bodies(CAMERA, (inside(seen),), 1.0)[0]
        error = np.linalg.norm(body.position_camera_m - person.chest_camera_m)
        errors.append(error / np.linalg.norm(person.chest_camera_m))
    return np.array(errors)


@pytest.mark.parametrize("lift_std_m", [0.0, 0.045])
@pytest.mark.parametrize("unit", [1.0, 1.0 / 1.74])
def test_position_of_an_average_adult_within_four_percent(lift_std_m, unit):
    errors = relative_errors(lift_std_m=lift_std_m, unit=unit)
    assert np.median(errors) <= 0.04
    assert np.percentile(errors, 90) <= 0.06


@pytest.mark.parametrize("unit", [0.01, 1.0, 37.0])
def test_the_scale_is_found_in_any_unit_and_despite_an_outlier(unit):
    person = person_at((0.0, 0.4, 3.0), stature_m=MEAN_STATURE_M)
    keypoints = person.keypoints(CAMERA, 0.0, np.random.default_rng(0), unit=unit)
    clean = scale_of(keypoints)
    assert clean * unit == pytest.approx(1.0, abs=0.05)
    wrong = np.array(keypoints.keypoints_root_m)
    wrong[9] += 2.0 * unit  # the left wrist two metres off
    outlier = scale_of(
        PersonKeypoints(keypoints.keypoints_px, wrong, keypoints.scores, keypoints.layout)
    )
    assert outlier * unit == pytest.approx(clean * unit, rel=0.03)


def test_one_outlier_hardly_moves_the_body():
    rng = np.random.default_rng(2)
    person = person_at((0.3, 0.4, 3.0))
    keypoints = person.keypoints(CAMERA, 1.0, rng)
    pixels = np.array(keypoints.keypoints_px)
    pixels[10] += (250.0, -180.0)
    outlier = PersonKeypoints(pixels, keypoints.keypoints_root_m, keypoints.scores, "coco")
    moved = place_bodies(CAMERA, (outlier,), 1.0)[0].position_camera_m
    still = place_bodies(CAMERA, (keypoints,), 1.0)[0].position_camera_m
    assert np.linalg.norm(moved - still) < 0.06


def test_a_body_with_two_keypoints_has_no_position():
    person = person_at((0.0, 0.4, 3.0)).keypoints(CAMERA, 0.0, np.random.default_rng(0))
    scores = np.zeros(17)
    scores[[5, 6]] = 1.0
    two = PersonKeypoints(person.keypoints_px, person.keypoints_root_m, scores, "coco")
    assert place_bodies(CAMERA, (two,), 1.0)[0] is None


def test_a_body_of_which_only_the_head_is_seen_has_a_larger_covariance():
    truth = person_at((0.0, 0.4, 3.0))
    person = truth.keypoints(CAMERA, 1.0, np.random.default_rng(0))
    head_only = PersonKeypoints(
        person.keypoints_px, person.keypoints_root_m, np.r_[np.ones(5), np.zeros(12)], "coco"
    )
    whole, head = (place_bodies(CAMERA, (seen,), 1.0)[0] for seen in (person, head_only))
    error = head.position_camera_m - truth.chest_camera_m
    assert error @ np.linalg.solve(head.position_covariance_m2, error) < 7.81
    assert head.position_covariance_m2[2, 2] > 2.0 * whole.position_covariance_m2[2, 2]


def test_the_box_of_a_standing_adult_gives_a_rough_position():
    person = person_at((0.8, 0.45, 5.0), stature_m=1.74)
    pixels = CAMERA.project(person.points_camera_m)
    left, top = pixels.min(axis=0)
    right, bottom = pixels.max(axis=0)
    position, covariance = place_boxes(
        CAMERA, [np.array([left, top - 20.0, right, bottom + 20.0])]
    )[0]
    error = position - person.chest_camera_m
    assert error @ np.linalg.solve(covariance, error) < 7.81
    assert place_boxes(CAMERA, [np.array([100.0, 100.0, 100.0, 100.0])])[0] is None


@pytest.mark.parametrize("shown", [0.35, 0.5, 0.7, 0.9])
def test_a_box_that_the_border_cuts_is_no_small_person_far_away(shown):
    """The lower border ends the picture of an adult 0.55 m wide, 1.5 m away."""
    width, height = 0.55 / 1.5 * CAMERA.fx_px, 1.74 / 1.5 * CAMERA.fy_px
    lower = float(CAMERA.height_px)
    top = lower - shown * height
    position, covariance = place_boxes(CAMERA, [np.array([600.0, top, 600.0 + width, lower])])[0]
    assert position[2] == pytest.approx(1.5, rel=0.2)
    # The same box in the middle of the image may be a whole one, and is farther away.
    inside, _ = place_boxes(CAMERA, [np.array([600.0, top - 60.0, 600.0 + width, lower - 60.0])])[0]
    assert inside[2] >= position[2]
    error = position - np.array([0.0, position[1], 1.5])
    assert error[2] ** 2 < 3.84 * covariance[2, 2]
