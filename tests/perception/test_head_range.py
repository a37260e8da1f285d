"""The head's range and the body's share the error of an unknown stature."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_people import Given, person_at

from perception import (
    AwarenessPipeline,
    Camera,
    HeadPose,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
    PnpHeadPoseEstimator,
)
from perception.anthropometry import (
    HEAD_CENTRE_HEAD_M,
    HEAD_TEMPLATE_M,
    STATURE_RELATIVE_STD,
    UNUSUAL_SIZE_LOG_OFFSET,
    UNUSUAL_SIZE_LOG_STD,
    UNUSUAL_SIZE_PROBABILITY,
)
from perception.body import place_bodies

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
IMAGE = np.zeros((480, 640, 3), np.uint8)
KEYPOINT_STD_PX = 2.0
# Adults' heads vary by 4 %, and their size follows the stature with a correlation of 0.4.
HEAD_STATURE_STD = 0.4 * 0.04
# Depth of the head against the chest, and how often each cue is wrong.
HEAD_OFFSET_M, BODY_WRONG, HEAD_WRONG = 0.05, 0.03, 0.05


def observed(person: PersonKeypoints, head: HeadPose | None) -> PersonObservation:
    given = Given([person], heads=[head])
    pipeline = AwarenessPipeline(CAMERA, given, given, given, keypoint_std_px=KEYPOINT_STD_PX)
    (observation,) = pipeline.process(IMAGE, 0.0)
    return observation


def range_std(observation: PersonObservation) -> float:
    """The relative standard deviation of the range."""
    position, covariance = observation.position_camera_m, observation.position_covariance_m2
    return math.sqrt(position @ covariance @ position) / float(position @ position)


def mixture_std(own: tuple[float, float], stature_stds: tuple[float, float]) -> float:
    """Two cues that agree: generalised least squares over what is right, by matrices.

    ``own`` are the variances of the cues but for the stature. The person is an adult who stands, or
    not; and each cue is right or wrong.
    """
    wrong = (BODY_WRONG, HEAD_WRONG)
    found = [(0.0, 0.5**2, 0.5**-1 * math.prod(0.5 * each for each in wrong))]
    unusual = (UNUSUAL_SIZE_LOG_STD, UNUSUAL_SIZE_LOG_STD)
    for usual, right in product((True, False), product((False, True), repeat=2)):
        if not any(right):
            continue
        rows = [row for row in range(2) if right[row]]
        shared = np.array([(stature_stds if usual else unusual)[row] for row in rows])
        covariance = np.diag([own[row] for row in rows]) + np.outer(shared, shared)
        information = float(np.linalg.inv(covariance).sum())
        weight = math.sqrt(2.0 * math.pi / information)
        weight /= math.sqrt(float(np.linalg.det(2.0 * math.pi * covariance)))
        weight *= 1.0 - UNUSUAL_SIZE_PROBABILITY if usual else UNUSUAL_SIZE_PROBABILITY
        for row in range(2):
            weight *= 1.0 - wrong[row] if right[row] else 0.5 * wrong[row]
        found.append((0.0 if usual else UNUSUAL_SIZE_LOG_OFFSET, 1.0 / information, weight))
    total = sum(weight for *_, weight in found)
    return math.sqrt(sum((off**2 + var) * weight for off, var, weight in found) / total)


@pytest.mark.parametrize(("range_m", "head_std"), [(2.5, 0.05), (5.0, 0.10)])
def test_the_range_is_that_of_cues_that_err_together(range_m: float, head_std: float) -> None:
    truth = person_at((0.2, 0.1, range_m), stature_m=1.74)
    person = truth.keypoints(CAMERA, 0.0, np.random.default_rng(0))
    alone = observed(person, None)
    body = place_bodies(CAMERA, (person,), KEYPOINT_STD_PX)[0]
    assert body is not None
    # A head where the body has it, so that the two agree and only their errors count.
    rotation = truth.rotation_camera_head
    centre = truth.points_camera_m[0] + rotation @ HEAD_CENTRE_HEAD_M
    head_depth = float(body.keypoints_camera_m[:5, 2].mean())
    nose = centre * head_depth / centre[2] - rotation @ HEAD_CENTRE_HEAD_M
    head = HeadPose(nose, rotation, 1e-4 * np.eye(6), 0.0, range_relative_std=head_std)
    both = observed(person, head)

    stature_std = min(body.scale_relative_std, STATURE_RELATIVE_STD)
    unusual = UNUSUAL_SIZE_LOG_STD**2 + UNUSUAL_SIZE_LOG_OFFSET**2
    lasting = stature_std**2 + UNUSUAL_SIZE_PROBABILITY * (unusual - stature_std**2)
    own = range_std(alone) ** 2 - lasting
    measured_std = math.hypot(head_std, HEAD_OFFSET_M / head_depth)
    head_stature_std = min(HEAD_STATURE_STD, 0.5 * measured_std)
    expected = mixture_std(
        (own, measured_std**2 - head_stature_std**2), (stature_std, head_stature_std)
    )
    assert range_std(both) == pytest.approx(expected, rel=2e-3)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.8, 1.6), st.floats(1.25, 2.2), st.floats(-0.3, 0.3))
def test_of_people_whom_the_border_cuts_the_face_tells_the_range(range_m, times, aside) -> None:
    """A pose network fits a whole body into the part that is seen: a small one, far away."""
    truth = person_at((aside * range_m, 0.35, range_m), stature_m=1.74)
    whole = truth.keypoints(CAMERA, 0.0, np.random.default_rng(0))
    neck_px = whole.keypoints_px[5:7].mean(axis=0)
    pixels = neck_px + (whole.keypoints_px - neck_px) / times
    scores = (pixels[:, 1] < CAMERA.height_px).astype(float)
    person = replace(whole, keypoints_px=pixels, scores=scores)
    head = HeadPose(
        truth.points_camera_m[0],
        truth.rotation_camera_head,
        1e-4 * np.eye(6),
        0.0,
        range_relative_std=0.07,
    )
    box = np.r_[whole.keypoints_px.min(axis=0), whole.keypoints_px[:, 0].max(), 480.0]
    networks = Given([person], [PersonDetection(box, 0.9)], [head])
    (seen,) = AwarenessPipeline(CAMERA, networks, networks, networks).process(IMAGE, 0.0)
    found_m = float(np.linalg.norm(seen.position_camera_m))
    true_m = float(np.linalg.norm(truth.chest_camera_m))
    assert found_m < 1.25 * true_m
    assert abs(found_m - true_m) < 2.0 * range_std(seen) * found_m


@settings(deadline=None, max_examples=30)
@given(st.floats(1.0, 4.0), st.floats(0.8, 1.2), st.floats(-0.5, 0.5))
def test_the_range_by_a_face_is_in_proportion_to_the_size_of_its_head(range_m, scale, yaw) -> None:
    person = person_at((0.1, 0.3, range_m), head_yaw_rad=yaw).keypoints(
        CAMERA, 0.0, np.random.default_rng(0)
    )
    person = replace(person, scores=(np.arange(17) < 5).astype(float))
    estimator = PnpHeadPoseEstimator()
    face_m = scale * HEAD_TEMPLATE_M
    (unmeasured,) = estimator.estimate(None, CAMERA, (person,))
    (measured,) = estimator.estimate(None, CAMERA, (replace(person, face_points_m=face_m),))
    assert unmeasured.range_relative_std is None
    assert measured.range_relative_std > 0.0
    np.testing.assert_allclose(
        measured.position_camera_m, scale * unmeasured.position_camera_m, rtol=0.02
    )
    assert measured.gaze_camera @ unmeasured.gaze_camera > math.cos(math.radians(1.0))
