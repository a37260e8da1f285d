"""Is a face seen at all, and what then may be believed about awareness."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from perception import AttentionCone, Camera, HeadPose, PersonKeypoints
from perception._evidence import judge_face
from perception.anthropometry import EYES_HEAD_M
from perception.awareness import awareness_of, cone_scores, estimate_awareness

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
CONE = AttentionCone()
ROBOT = np.zeros((1, 3))
FACING = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], axis=1)
NO_EYES = (0.0, 0.0)


def head_at(yaw_deg=0.0, distance_m=2.0, std_rad=0.03, *, seen=None, error_px=0.0, pitch_deg=0.0):
    """A head whose eyes are straight ahead of the camera; yaw 0 faces it."""
    turn = Rotation.from_euler("xz", [yaw_deg, pitch_deg], degrees=True).as_matrix()
    rotation = FACING @ turn
    position = np.array([0.0, 0.0, distance_m]) - rotation @ EYES_HEAD_M
    covariance = np.diag([std_rad**2] * 3 + [1e-10] * 3)
    return HeadPose(position, rotation, covariance, error_px, seen)


def with_scores(*scores, face_evidence=True):
    padded = np.zeros(17)
    padded[: len(scores)] = scores
    return PersonKeypoints(
        np.zeros((17, 2)), np.zeros((17, 3)), padded, "coco", face_evidence=face_evidence
    )


ALL = with_scores(1, 1, 1, 1, 1)


def believed(head, *, seen=1.0, eyes=NO_EYES, extra=0.0, points=ROBOT):
    (estimate,) = estimate_awareness(
        CONE,
        (head,),
        points,
        extra_std_rad=np.array([extra]),
        eye_in_head_std_rad=eyes,
        face_seen=np.array([seen]),
    )
    return estimate.awareness, estimate.awareness_std


def judged(head, person=ALL, eyes=NO_EYES):
    evidence = judge_face(CAMERA, person, head, 0.3)
    if evidence is None:
        return None
    return believed(head, seen=evidence.seen, extra=evidence.extra_std_rad, eyes=eyes)


# --- the face -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scores", "low", "high"),
    [
        ((1, 1, 1, 1, 1), 1.0, 1.0),
        ((1, 1, 0, 1, 0), 1.0, 1.0),  # three-quarter view: nose and near eye
        ((0, 1, 1, 1, 1), 1.0, 1.0),  # a mask hides the nose
        ((1, 0, 0, 0, 0), 0.0, 0.0),  # a nose alone is no face
        ((0, 0, 0, 1, 1), 0.0, 0.0),  # the back of a head
        ((0.3, 0.3, 0.3, 1, 1), 0.45, 0.55),
    ],
)
def test_two_of_nose_and_eyes_make_a_face(scores, low, high):
    evidence = judge_face(CAMERA, with_scores(*scores), head_at(), 0.3)
    assert low - 1e-9 <= evidence.seen <= high + 1e-9


def test_a_head_of_which_nothing_is_seen_is_no_evidence():
    assert judge_face(CAMERA, with_scores(0, 0, 0, 0, 0), head_at(), 0.3) is None
    assert judge_face(CAMERA, with_scores(0.2, 0.2, 0.1, 0.2, 0.0), head_at(), 0.3) is None


@given(st.lists(st.floats(0.3, 1.0), min_size=5, max_size=5), st.integers(0, 4))
def test_a_higher_score_never_hides_a_face(scores, which):
    raised = list(scores)
    raised[which] = min(1.0, raised[which] + 0.2)
    before, after = (judge_face(CAMERA, with_scores(*s), head_at(), 0.3) for s in (scores, raised))
    assert after.seen >= before.seen


def moved(head, x_m):
    position = head.position_camera_m + np.array([x_m, 0.0, 0.0])
    return HeadPose(
        position,
        head.rotation_camera_head,
        head.covariance,
        head.reprojection_error_px,
        head.face_seen,
    )


@pytest.mark.parametrize("person", [with_scores(0, 0, 0, 1, 0), with_scores(1, 0, 0, 1, 0)])
@pytest.mark.parametrize("seen", [None, 0.02])
def test_a_face_beyond_the_pictures_edge_is_not_a_face_turned_away(person, seen):
    """Half a head at the edge: whether it shows the camera a face is open, not denied."""
    edge_m = 0.5 * CAMERA.width_px / CAMERA.fx_px * 2.0
    inside, cut = moved(head_at(seen=seen), edge_m - 0.3), moved(head_at(seen=seen), edge_m + 0.05)
    assert judge_face(CAMERA, person, inside, 0.3).seen <= 0.02
    assert judge_face(CAMERA, person, cut, 0.3).seen == pytest.approx(0.5)
    _, std = judged(cut, person)
    assert std > 0.29  # the tracker takes it for no evidence
    # A back of a head there is still known to look away.
    away = moved(head_at(180.0, seen=seen), edge_m + 0.05)
    alpha, std = judged(away, person)
    assert alpha == pytest.approx(0.0, abs=1e-6)
    assert std < 0.05


def test_the_estimators_own_word_comes_first():
    head = head_at(seen=0.05)
    assert judge_face(CAMERA, ALL, head, 0.3).seen == pytest.approx(0.05)
    assert judge_face(CAMERA, with_scores(), head_at(seen=0.9), 0.3).seen == pytest.approx(0.9)


def test_scores_that_are_no_evidence_leave_it_open():
    mediapipe = with_scores(1, 1, 1, 1, 1, face_evidence=False)
    assert judge_face(CAMERA, mediapipe, head_at(), 0.3).seen == 0.5
    alpha, std = judged(head_at(), mediapipe)
    assert alpha - 1.28 * std < 0.1


@given(st.floats(0.0, 60.0), st.floats(0.0, 60.0))
def test_keypoints_off_the_template_speak_against_the_face(first, second):
    less, more = sorted([first, second])
    near, far = (judge_face(CAMERA, ALL, head_at(error_px=error), 0.3) for error in (less, more))
    assert far.seen <= near.seen
    # 43 px of face at 2 m: half of it off is no face.
    assert judge_face(CAMERA, ALL, head_at(error_px=30.0), 0.3).seen < 0.05


def test_size_decides_how_much_a_face_says():
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
    assert judge_face(CAMERA, ALL, far, 0.3) is None


# --- what the issue asks for ---------------------------------------------------------------------


def test_the_back_of_a_head_is_a_confident_zero():
    """By the direction of the head, and by its ears alone, whatever direction PnP found."""
    alpha, std = judged(head_at(180.0, std_rad=0.2))
    assert (alpha, std) == (0.0, pytest.approx(0.0, abs=1e-3))
    alpha, std = judged(head_at(10.0, std_rad=0.6), with_scores(0, 0, 0, 1, 1))
    assert (alpha, std) == (0.0, pytest.approx(0.0, abs=1e-3))


def test_a_face_of_twelve_pixels_is_a_weak_measurement():
    small = head_at(distance_m=0.156 * CAMERA.fx_px / 12.0)
    alpha, std = judged(small)
    near_alpha, near_std = judged(head_at(distance_m=2.0))
    assert std > 0.15
    assert std > 8.0 * near_std
    assert alpha - 1.28 * std < 0.5 < near_alpha - 1.28 * near_std


# --- α and its standard deviation ----------------------------------------------------------------


@given(st.floats(0.0, math.pi))
def test_scores_by_angle_are_scores_by_geometry(angle):
    target = np.array([math.sin(angle), 0.0, math.cos(angle)])
    direct = CONE.score(np.zeros(3), [0.0, 0.0, 1.0], target)
    assert cone_scores(CONE, np.array([math.cos(angle)]))[0] == pytest.approx(direct, abs=1e-6)


@pytest.mark.parametrize("yaw_deg", [0, 15, 30, 50, 58, 63, 75])
@pytest.mark.parametrize("std_deg", [2.0, 8.0, 20.0])
def test_standard_deviation_is_the_distance_of_the_truth_from_alpha(yaw_deg, std_deg):
    """Monte Carlo: gazes drawn about the estimate, eyes drawn in the head."""
    head = head_at(yaw_deg, std_rad=math.radians(std_deg))
    eyes = (math.radians(7.0), math.radians(3.4))
    alpha, std = believed(head, eyes=eyes)
    rng = np.random.default_rng(0)
    count = 20000
    turns = Rotation.from_rotvec(rng.normal(0.0, math.radians(std_deg), (count, 3))).as_matrix()
    in_head = np.column_stack(
        [rng.normal(0.0, eyes[0], count), np.zeros(count), rng.normal(0.0, eyes[1], count)]
    )
    rotations = turns @ head.rotation_camera_head @ Rotation.from_rotvec(in_head).as_matrix()
    apex = np.array([0.0, 0.0, 2.0])
    truth = CONE.score(np.tile(apex, (count, 1)), rotations[:, :, 1], np.zeros((count, 3)))
    assert std == pytest.approx(math.sqrt(np.mean((truth - alpha) ** 2)), rel=0.08, abs=0.004)


def test_calibration_where_the_eyes_wander():
    """Heads on the cone's flank: the true α lies within one σ 68 times in a hundred."""
    rng = np.random.default_rng(1)
    eyes = (math.radians(7.0), math.radians(3.4))
    within = []
    for _ in range(1500):
        true_yaw, std = rng.uniform(10.0, 45.0), math.radians(rng.uniform(2.0, 8.0))
        error = Rotation.from_rotvec(rng.normal(0.0, std, 3)).as_matrix()
        true = head_at(true_yaw)
        measured = HeadPose(
            true.position_camera_m,
            error @ true.rotation_camera_head,
            np.diag([std**2] * 3 + [1e-10] * 3),
            0.0,
        )
        turn = Rotation.from_rotvec(rng.normal(0.0, [eyes[0], 0.0, eyes[1]])).as_matrix()
        gaze = (true.rotation_camera_head @ turn)[:, 1]
        eyes_at = true.position_camera_m + true.rotation_camera_head @ EYES_HEAD_M
        alpha, sigma = believed(measured, eyes=eyes)
        within.append(abs(CONE.score(eyes_at, gaze, np.zeros(3)) - alpha) < sigma)
    assert 0.60 <= np.mean(within) <= 0.76


@given(st.floats(0.0, 180.0), st.floats(0.01, 1.0), st.floats(0.0, 0.5), st.floats(0.0, 1.0))
def test_doubt_never_raises_alpha(yaw_deg, std_rad, extra, seen):
    head = head_at(yaw_deg, std_rad=std_rad)
    nominal = CONE.score([0.0, 0.0, 2.0], head.gaze_camera, np.zeros(3))
    alpha, std = believed(head, extra=extra, seen=seen)
    assert 0.0 <= alpha <= nominal + 1e-9
    assert 0.0 <= std <= 1.0
    assert alpha <= believed(head, extra=extra, seen=min(1.0, seen + 0.1))[0] + 1e-12


@given(st.floats(0.0, 1.0), st.floats(0.0, 70.0))
def test_a_face_that_may_not_be_seen_mixes_both_cases(seen, yaw_deg):
    """Moments of: with probability p the score of the head, else 0."""
    head = head_at(yaw_deg, std_rad=1e-6)
    sure, _ = believed(head)
    alpha, std = believed(head, seen=seen)
    assert alpha == pytest.approx(seen * sure, abs=1e-5)
    assert std == pytest.approx(sure * math.sqrt(seen * (1.0 - seen)), abs=1e-3)


def test_people_together_are_people_one_by_one():
    rng = np.random.default_rng(2)
    points = rng.normal(0.0, 0.3, (4, 3))
    heads = tuple(
        head_at(yaw, distance, std)
        for yaw, distance, std in zip(
            rng.uniform(-90, 90, 6), rng.uniform(1, 5, 6), rng.uniform(0.01, 0.4, 6), strict=True
        )
    )
    together = estimate_awareness(
        CONE,
        heads,
        points,
        extra_std_rad=np.full(6, 0.02),
        eye_in_head_std_rad=(0.1, 0.05),
        face_seen=np.full(6, 0.8),
    )
    for head, estimate in zip(heads, together, strict=True):
        alone = believed(head, seen=0.8, eyes=(0.1, 0.05), extra=0.02, points=points)
        assert (estimate.awareness, estimate.awareness_std) == pytest.approx(alone)


@given(st.floats(-math.pi, math.pi), st.floats(-0.5, 0.5), st.floats(0.0, 90.0))
def test_turning_the_world_about_the_robot_changes_nothing(about_y, about_x, yaw_deg):
    head = head_at(yaw_deg, std_rad=0.1)
    turn = Rotation.from_euler("yx", [about_y, about_x]).as_matrix()
    both = np.kron(np.eye(2), turn)
    moved = HeadPose(
        turn @ head.position_camera_m,
        turn @ head.rotation_camera_head,
        both @ head.covariance @ both.T,
        0.0,
    )
    eyes = (0.12, 0.06)
    assert believed(moved, eyes=eyes) == pytest.approx(believed(head, eyes=eyes), abs=1e-6)


def test_eyes_wander_more_sideways_than_up():
    """A robot beside the gaze is reached by eyes that turn sideways, one above by raised eyes."""
    eyes = (math.radians(10.0), 0.0)
    beside, above = (
        believed(head_at(yaw, pitch_deg=pitch, std_rad=1e-3), eyes=eyes)[1]
        for yaw, pitch in ((30.0, 0.0), (0.0, 30.0))
    )
    assert beside > 3.0 * above


def test_the_measurements_own_deviation_has_no_eyes_in_it():
    head = head_at(30.0, std_rad=0.05)
    alpha, std = awareness_of(CONE, head, ROBOT)
    posed, posed_std = believed(head)
    assert posed == pytest.approx(alpha, abs=0.01)
    assert posed_std == pytest.approx(std, rel=0.05)
    assert believed(head, eyes=(0.12, 0.06))[1] > 1.5 * std
