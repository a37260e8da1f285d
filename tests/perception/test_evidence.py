"""Evidence of a face, and the awareness and standard deviation that follow from it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from synthetic_people import FACING, awareness_of

from perception import AttentionCone, Camera, HeadPose, PersonKeypoints, PnpHeadPoseEstimator
from perception.anthropometry import EYES_HEAD_M
from perception.evidence import FaceEvidence, judge_face

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
CONE = AttentionCone()
NO_HEAD = "no keypoint of the head"


def head_at(yaw_deg=0.0, distance_m=2.0, std_rad=0.03, *, seen=None, error_px=0.0, pitch_deg=0.0):
    """Return a head with its eyes on the camera's axis; yaw 0 faces the camera."""
    turn = Rotation.from_euler("xz", [yaw_deg, pitch_deg], degrees=True).as_matrix()
    rotation = FACING @ turn
    position = np.array([0.0, 0.0, distance_m]) - rotation @ EYES_HEAD_M
    covariance = np.diag([std_rad**2] * 3 + [1e-10] * 3)
    return HeadPose(position, rotation, covariance, error_px, seen)


def with_scores(*scores, face_evidence=True, at_px=(320.0, 240.0)):
    padded = np.zeros(17)
    padded[: len(scores)] = scores
    pixels = np.tile(at_px, (17, 1))
    return PersonKeypoints(pixels, np.zeros((17, 3)), padded, "coco", face_evidence=face_evidence)


ALL = with_scores(1, 1, 1, 1, 1)


def awareness_with_evidence(head, person=ALL):
    evidence = judge_face(CAMERA, person, head, 0.3)
    return awareness_of(head, seen=evidence.seen, extra_std_rad=evidence.extra_std_rad)


# --- evidence of a face -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scores", "low", "high"),
    [
        ((1, 1, 1, 1, 1), 1.0, 1.0),
        ((1, 1, 0, 1, 0), 1.0, 1.0),  # half turned: nose and near eye
        ((0, 1, 1, 1, 1), 1.0, 1.0),  # a mask hides the nose
        ((1, 0, 0, 0, 0), 0.0, 0.0),  # the nose only
        ((0, 0, 0, 1, 1), 0.0, 0.0),  # the back of a head
        ((0.3, 0.3, 0.3, 1, 1), 0.45, 0.55),
    ],
)
def test_two_of_nose_and_eyes_make_a_face(scores, low, high):
    for unseen in ((0, 0, 0, 0, 0), (0.2, 0.2, 0.1, 0.2, 0.0)):
        assert judge_face(CAMERA, with_scores(*unseen), head_at(), 0.3) == NO_HEAD
    evidence = judge_face(CAMERA, with_scores(*scores), head_at(), 0.3)
    assert low - 1e-9 <= evidence.seen <= high + 1e-9


@given(st.lists(st.floats(0.3, 1.0), min_size=5, max_size=5), st.integers(0, 4))
def test_a_higher_score_never_lowers_the_probability_of_a_face(scores, which):
    raised = list(scores)
    raised[which] = min(1.0, raised[which] + 0.2)
    before, after = (judge_face(CAMERA, with_scores(*s), head_at(), 0.3) for s in (scores, raised))
    assert after.seen >= before.seen


def moved(head, x_m):
    return replace(head, position_camera_m=head.position_camera_m + np.array([x_m, 0.0, 0.0]))


@pytest.mark.parametrize("at_px", [(12.0, 240.0), (630.0, 240.0), (320.0, 3.0), (320.0, 470.0)])
def test_a_head_at_the_border_is_no_evidence_if_a_part_of_its_face_is_missing(at_px):
    """Whether the missing eye is cut off or turned away nobody knows, and the pose is wrong."""
    for scores in ((1, 0, 1, 0, 1), (1, 0, 0, 0, 0), (0, 0, 0, 1, 1)):
        person = with_scores(*scores, at_px=at_px)
        assert judge_face(CAMERA, person, head_at(), 0.3) == "face cut by the border"
        assert judge_face(CAMERA, person, head_at(seen=0.9), 0.3).seen == 0.9  # sees it itself
    whole = with_scores(1, 1, 1, 0, 0, at_px=at_px)
    assert judge_face(CAMERA, whole, head_at(), 0.3).seen == 1.0


@pytest.mark.parametrize("person", [with_scores(0, 0, 0, 1, 0), with_scores(1, 0, 0, 1, 0)])
@pytest.mark.parametrize("seen", [None, 0.02])
def test_a_face_cut_off_by_the_border_does_not_count_as_turned_away(person, seen):
    """Half a head at the border: the probability that the face is seen is 0.5, not 0."""
    border_m = 0.5 * CAMERA.width_px / CAMERA.fx_px * 2.0
    inside = moved(head_at(seen=seen), border_m - 0.3)
    cut = moved(head_at(seen=seen), border_m + 0.05)
    assert judge_face(CAMERA, person, inside, 0.3).seen <= 0.02
    assert judge_face(CAMERA, person, cut, 0.3).seen == pytest.approx(0.5)
    _, std = awareness_with_evidence(cut, person)
    assert std > 0.29  # the tracker treats it as no evidence
    # The back of a head at the same place is still unaware.
    away = moved(head_at(180.0, seen=seen), border_m + 0.05)
    alpha, std = awareness_with_evidence(away, person)
    assert alpha == pytest.approx(0.0, abs=1e-6)
    assert std < 0.05


def test_an_unknown_direction_is_evidence_of_the_back_of_a_head_only():
    """15° bound what a network may say of a face; keypoints without a network have no bound."""
    sure, unsure = (head_at(std_rad=math.radians(deg), seen=0.9) for deg in (14.9, 15.1))
    assert judge_face(CAMERA, ALL, sure, 0.3).direction_known
    assert judge_face(CAMERA, ALL, unsure, 0.3) == "head direction unknown"
    back = judge_face(CAMERA, ALL, head_at(std_rad=0.6, seen=0.05), 0.3)
    assert not back.direction_known
    assert back.seen == pytest.approx(0.05)
    assert judge_face(CAMERA, ALL, head_at(std_rad=0.6), 0.3).direction_known


@pytest.mark.parametrize("yaw_deg", [0.0, 70.0, 180.0])
@pytest.mark.parametrize("axis", range(3))
def test_a_tilt_about_the_gaze_is_no_uncertainty_of_the_direction(yaw_deg, axis):
    head = head_at(yaw_deg, seen=0.9)
    direction = head.rotation_camera_head[:, axis]
    covariance = head.covariance + 0.0
    covariance[:3, :3] += 0.5**2 * np.outer(direction, direction)
    judged = judge_face(CAMERA, ALL, replace(head, covariance=covariance), 0.3)
    assert (judged == "head direction unknown") == (axis != 1)


@given(st.floats(0.0, 180.0), st.floats(0.6, 5.0))
def test_where_no_face_was_found_one_is_unlikely_but_possible(yaw_deg, distance_m):
    unfound = with_scores(1, 1, 1, 1, 1, face_evidence=False)
    head = head_at(yaw_deg, distance_m)
    judged = judge_face(CAMERA, unfound, head, 0.3)
    if abs(math.degrees(head.off_camera_rad) - 50.0) < 1e-3:
        return
    if head.off_camera_rad < math.radians(50.0):
        # Keypoints and the network of faces contradict each other: that is no evidence.
        assert judged == "face missed"
    elif 0.156 * CAMERA.fx_px / head.position_camera_m[2] < 20.0:
        assert judged == "no face found"  # a small one may have been missed
    else:
        assert judged.seen == 0.2
        alpha, std = awareness_with_evidence(head, unfound)
        assert alpha - 1.28 * std < 0.1
    assert judge_face(CAMERA, ALL, head, 0.3).seen == 1.0


@given(st.floats(0.0, 60.0), st.floats(0.0, 60.0))
def test_a_reprojection_error_lowers_the_probability_of_a_face(first, second):
    less, more = sorted([first, second])
    near, far = (judge_face(CAMERA, ALL, head_at(error_px=error), 0.3) for error in (less, more))
    assert far.seen <= near.seen
    # At 2 m the face is 43 px wide; an error of 30 px leaves almost no probability.
    assert judge_face(CAMERA, ALL, head_at(error_px=30.0), 0.3).seen < 0.05


def test_a_smaller_face_has_a_larger_standard_deviation():
    width = {
        px: judge_face(CAMERA, ALL, head_at(distance_m=0.156 * CAMERA.fx_px / px), 0.3)
        for px in (60, 30, 20, 12, 6)
    }
    for px, evidence in width.items():
        assert evidence.width_px == pytest.approx(px, rel=0.02)
    extra = [evidence.extra_std_rad for evidence in width.values()]
    assert extra == sorted(extra)
    assert extra[1] < math.radians(1.0)
    far = head_at(distance_m=0.156 * CAMERA.fx_px / 4.0)
    assert judge_face(CAMERA, ALL, far, 0.3) == "face too small"
    # One of twelve pixels is a weak measurement.
    alpha, std = awareness_with_evidence(head_at(distance_m=0.156 * CAMERA.fx_px / 12.0))
    near_alpha, near_std = awareness_with_evidence(head_at(distance_m=2.0))
    assert std > 0.15
    assert std > 8.0 * near_std
    assert alpha - 1.28 * std < 0.5 < near_alpha - 1.28 * near_std


def test_the_back_of_a_head_has_awareness_0_with_certainty():
    """The head's direction shows it, or seen ears without a face, whatever direction PnP found."""
    alpha, std = awareness_with_evidence(head_at(180.0, std_rad=0.2))
    assert (alpha, std) == (0.0, pytest.approx(0.0, abs=1e-3))
    alpha, std = awareness_with_evidence(head_at(10.0, std_rad=0.6), with_scores(0, 0, 0, 1, 1))
    assert (alpha, std) == (0.0, pytest.approx(0.0, abs=1e-3))


# --- α and its standard deviation ----------------------------------------------------------------


@given(st.floats(0.0, 180.0), st.floats(0.01, 1.0), st.floats(0.0, 0.5), st.floats(0.0, 1.0))
def test_uncertainty_never_raises_alpha(yaw_deg, std_rad, extra, seen):
    head = head_at(yaw_deg, std_rad=std_rad)
    nominal = CONE.score([0.0, 0.0, 2.0], head.gaze_camera, np.zeros(3))
    alpha, std = awareness_of(head, extra_std_rad=extra, seen=seen)
    assert 0.0 <= alpha <= nominal + 1e-9
    assert 0.0 <= std <= 1.0
    assert alpha <= awareness_of(head, extra_std_rad=extra, seen=min(1.0, seen + 0.1))[0] + 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("height_px", [(40.0, 110.0), (110.0, 400.0)], ids=["small", "large"])
def test_random_keypoints_with_good_scores_are_hardly_ever_aware(height_px):
    """Keypoints drawn evenly in a box, all with a score of at least 0.5."""
    rng = np.random.default_rng(77)
    estimator, aware, count = PnpHeadPoseEstimator(), 0, 200
    for _ in range(count):
        height = rng.uniform(*height_px)
        size = np.array([height * rng.uniform(0.3, 0.6), height])
        pixels = rng.uniform((0.0, 0.0), (640.0, 480.0) - size) + size * rng.random((17, 2))
        lifted = np.c_[(pixels - pixels[11:13].mean(axis=0)) * 1.75 / height, rng.normal(size=17)]
        person = PersonKeypoints(pixels, lifted, rng.uniform(0.5, 1.0, 17), "coco")
        (head,) = estimator.estimate(None, CAMERA, (person,))
        evidence = None if head is None else judge_face(CAMERA, person, head, 0.3)
        if isinstance(evidence, FaceEvidence):
            aware += (
                awareness_of(head, seen=evidence.seen, extra_std_rad=evidence.extra_std_rad)[0]
                >= 0.5
            )
    assert aware < 0.01 * count


def test_a_head_larger_than_its_body_is_no_evidence():
    # The face is 43 px wide at 2 m; the shoulder is 40 px away.
    pixels = np.tile((320.0, 240.0), (17, 1))
    pixels[5] += (0.0, 40.0)
    near = PersonKeypoints(pixels, np.zeros((17, 3)), np.ones(17), "coco")
    assert judge_face(CAMERA, near, head_at(), 0.3) == "no body has such limbs"
    pixels[5] += (0.0, 60.0)
    person = PersonKeypoints(pixels, np.zeros((17, 3)), np.ones(17), "coco")
    assert isinstance(judge_face(CAMERA, person, head_at(), 0.3), FaceEvidence)
