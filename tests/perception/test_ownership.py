"""Whose keypoints: one skeleton for each detection, and only one that a body could have."""

from __future__ import annotations

import math
from dataclasses import replace

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
)
from perception.layouts import HEAD
from perception.ownership import (
    DISOWNED,
    FoundPerson,
    disowned_keypoints,
    own_heads,
    without_disowned,
)

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
WIDE = Camera.from_fov(1920, 1200, math.radians(120.0))
BLANK = np.zeros((480, 640, 3), np.uint8)
SKELETON, OUTSIDE, LIMBS, SHARED_HEAD = DISOWNED


def seen(x_m=0.0, depth_m=4.0, *, yaw=0.0, seed=0, score=1.0, camera=CAMERA):
    """Keypoints of somebody who faces the camera at yaw 0, and their tight box."""
    person = person_at((x_m, 0.2, depth_m), body_yaw_rad=yaw)
    found = person.keypoints(camera, 1.0, np.random.default_rng(seed))
    pixels = found.keypoints_px
    pad = 0.06 * np.ptp(pixels[:, 1])
    box = np.r_[pixels.min(axis=0) - pad, pixels.max(axis=0) + pad]
    return found, PersonDetection(box, score)


def changed(person, pixels=None, scores=None):
    return PersonKeypoints(
        person.keypoints_px if pixels is None else pixels,
        person.keypoints_root_m,
        person.scores if scores is None else scores,
        person.layout,
    )


def shifted(detection, by_px, score=None):
    return PersonDetection(
        detection.box_xyxy_px + np.tile(by_px, 2), detection.score if score is None else score
    )


def reasons(*pairs):
    people, detections = zip(*pairs, strict=True)
    return disowned_keypoints(CAMERA, detections, people, 0.3)


# --- who keeps a skeleton -----------------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(
    st.floats(-1.0, 1.0),
    st.floats(1.6, 8.0),
    st.floats(-3.1, 3.1),
    st.floats(-1.2, 1.2),
    st.floats(0.0, 1.5),
)
def test_two_people_beside_or_behind_each_other_keep_their_own(x_m, depth_m, yaw, aside, behind):
    one = seen(x_m, depth_m, yaw=yaw)
    other = seen(x_m + aside, depth_m + 0.35 + behind, yaw=-yaw, seed=1)
    # Whoever stands behind is half hidden: only what is not in the first one's box is seen.
    box, pixels = one[1].box_xyxy_px, other[0].keypoints_px
    hidden = ((pixels > box[:2]) & (pixels < box[2:])).all(axis=1)
    half = changed(other[0], scores=np.where(hidden, 0.0, other[0].scores))
    assert reasons(one, (half, other[1])) == [None, None]


def test_of_two_boxes_with_one_skeleton_that_which_fits_keeps_it():
    person, detection = seen()
    wide = 0.35 * float(detection.box_xyxy_px[2] - detection.box_xyxy_px[0])
    neighbour = shifted(detection, (wide, 0.0))
    again = changed(person, person.keypoints_px + np.random.default_rng(1).normal(0, 2, (17, 2)))
    assert reasons((person, detection), (again, neighbour)) == [None, SKELETON]
    assert reasons((again, neighbour), (person, detection)) == [SKELETON, None]
    # A sure detection keeps it from a doubtful one with much the same box.
    doubtful = shifted(detection, (1.0, 0.0), score=0.3)
    assert reasons((person, doubtful), (again, detection)) == [SKELETON, None]


@given(st.permutations(range(4)))
def test_the_order_of_detections_does_not_matter(order):
    one, other = seen(-0.8), seen(0.8, seed=1)
    thief = (changed(one[0]), shifted(one[1], (50.0, 0.0)))
    crooked = changed(other[0], other[0].keypoints_px + np.array([300.0, 0.0]))
    pairs = [one, other, thief, (crooked, other[1])]
    wanted = [None, None, SKELETON, OUTSIDE]
    assert reasons(*(pairs[row] for row in order)) == [wanted[row] for row in order]


@settings(deadline=None, max_examples=30)
@given(st.floats(0.3, 4.0))
def test_the_resolution_of_the_camera_does_not_matter(factor):
    zoomed = Camera.from_fov(round(640 * factor), round(480 * factor), math.radians(60.0))
    person, detection = seen()
    pixels = person.keypoints_px.copy()
    pixels[HEAD, 1] -= 150.0
    pairs = [
        (person, detection),
        (changed(person), shifted(detection, (25.0, 0.0))),
        (changed(person, pixels), detection),
    ]
    larger = [
        (changed(each, each.keypoints_px * factor), PersonDetection(box.box_xyxy_px * factor, 1.0))
        for each, box in pairs
    ]
    people, detections = zip(*larger, strict=True)
    assert disowned_keypoints(zoomed, detections, people, 0.3) == [None, SKELETON, LIMBS]
    assert reasons(*pairs) == [None, SKELETON, LIMBS]


# --- what no body has ---------------------------------------------------------------------------


@settings(deadline=None, max_examples=100)
@given(
    st.floats(-1.7, 1.7),
    st.floats(1.2, 10.0),
    st.floats(-3.2, 3.2),
    st.integers(0, 100),
    st.sets(st.integers(0, 16), max_size=10),
)
def test_no_real_body_is_refused_by_a_wide_lens(aside, depth_m, yaw, seed, missing):
    person, detection = seen(aside * depth_m, depth_m, yaw=yaw, seed=seed, camera=WIDE)
    scores = person.scores.copy()
    scores[list(missing)] = 0.0
    pairs = [detection], [changed(person, scores=scores)]
    assert disowned_keypoints(WIDE, *pairs, 0.3) == [None]


@pytest.mark.parametrize(
    ("rows", "shift_px", "reason"),
    [
        (slice(None), (200.0, 0.0), OUTSIDE),
        (HEAD, (0.0, -90.0), LIMBS),
        (HEAD, (120.0, 0.0), LIMBS),
        ([13, 15], (0.0, 120.0), LIMBS),  # a knee and a foot of somebody nearer
    ],
    ids=["beside the box", "head above", "head beside", "long leg"],
)
def test_keypoints_of_two_people_are_refused(rows, shift_px, reason):
    person, detection = seen()
    pixels = person.keypoints_px.copy()
    pixels[rows] += shift_px
    assert reasons((changed(person, pixels), detection)) == [reason]


def test_a_head_that_two_skeletons_claim_belongs_to_the_better():
    front, behind = seen(0.0, 3.0), seen(0.42, 3.6, seed=1)
    pixels = behind[0].keypoints_px.copy()
    pixels[HEAD] = front[0].keypoints_px[HEAD] + 1.0
    claimed = changed(behind[0], pixels)
    assert reasons((claimed, behind[1]), front) == [SHARED_HEAD, None]
    own = without_disowned(claimed, SHARED_HEAD)
    assert own.scores[HEAD].max() == 0.0
    assert np.array_equal(own.scores[5:], claimed.scores[5:])
    assert without_disowned(claimed, SKELETON).scores.max() == 0.0
    assert without_disowned(claimed, None) is claimed


# --- heads that no neck carries -----------------------------------------------------------------


def with_head(x_m=0.0, depth_m=4.0, *, camera=CAMERA, noise_px=1.0, seed=0, **pose):
    """A person as found, and the true pose of the head."""
    person = person_at((x_m, 0.2, depth_m), **pose)
    found = person.keypoints(camera, noise_px, np.random.default_rng(seed))
    pixels = found.keypoints_px
    box = PersonDetection(np.r_[pixels.min(axis=0), pixels.max(axis=0)], 0.9)
    covariance = np.diag([0.01] * 3 + [0.0025] * 3)
    head = HeadPose(person.points_camera_m[0], person.rotation_camera_head, covariance, 0.5)
    return FoundPerson(box, found, None), head


def reason_of(one, head, camera=CAMERA):
    """Return why the head is not the person's; it has no pose and no score then."""
    (left,), (kept,) = own_heads(camera, (one,), (head,), 0.3)
    if left.disowned is None:
        assert left is one
        assert kept is head
    else:
        assert kept is None
        assert left.keypoints.scores[HEAD].max() == 0.0
        assert np.array_equal(left.keypoints.scores[5:], one.keypoints.scores[5:])
    return left.disowned


def moved_head(one, across_m, up_m, depth_m):
    pixels = one.keypoints.keypoints_px.copy()
    pixels[HEAD] += np.array([across_m, -up_m]) * CAMERA.fx_px / depth_m
    return one._replace(keypoints=changed(one.keypoints, pixels))


@settings(deadline=None, max_examples=150)
@given(
    st.floats(-1.5, 1.5),
    st.floats(1.5, 5.0),
    st.floats(-3.2, 3.2),
    st.floats(-65.0, 65.0),
    st.floats(-40.0, 30.0),
    st.floats(1.2, 2.0),
    st.integers(0, 100),
)
def test_a_head_that_the_neck_can_turn_stays(
    aside, depth_m, yaw, turn_deg, nod_deg, stature_m, seed
):
    pose = {
        "body_yaw_rad": yaw,
        "head_yaw_rad": math.radians(turn_deg),
        "head_pitch_rad": math.radians(nod_deg),
        "stature_m": stature_m,
    }
    one, head = with_head(aside * depth_m, depth_m, camera=WIDE, seed=seed, **pose)
    assert reason_of(one, head, WIDE) is None


@settings(deadline=None, max_examples=60)
@given(
    st.floats(-1.5, 1.5),
    st.floats(1.5, 8.0),
    st.floats(150.0, 210.0),
    st.floats(-15.0, 15.0),
    st.integers(0, 100),
)
def test_a_face_over_a_back_is_anothers(aside, depth_m, yaw_deg, off_deg, seed):
    yaw = math.radians(yaw_deg)
    # Yaw 0 faces the camera's plane, not the camera.
    pose = {"body_yaw_rad": yaw - math.atan(aside), "head_yaw_rad": math.radians(off_deg) - yaw}
    one, head = with_head(aside * depth_m, depth_m, camera=WIDE, seed=seed, **pose)
    assert reason_of(one, head, WIDE) == SHARED_HEAD


@settings(deadline=None, max_examples=40)
@given(st.floats(0.4, 0.55), st.floats(-1.0, 4.1), st.floats(2.0, 6.0))
def test_a_face_away_from_the_neck_is_anothers(away_m, direction_rad, depth_m):
    one, head = with_head(depth_m=depth_m)
    # The head's own place is about 0.2 m above the neck.
    across, up = away_m * math.cos(direction_rad), away_m * math.sin(direction_rad) - 0.2
    assert reason_of(moved_head(one, across, up, depth_m), head) == SHARED_HEAD


@settings(deadline=None, max_examples=60)
@given(st.floats(0.22, 0.28), st.floats(-0.9, 0.9), st.floats(1.4, 1.5), st.floats(1.2, 3.0))
def test_a_head_that_leans_over_a_body_that_seems_far_is_its_own(neck_m, lean_rad, times, depth_m):
    """Pose networks make bodies of near people small: the face knows better how near they are."""
    one, head = with_head(depth_m=depth_m, camera=WIDE)
    pixels = one.keypoints.keypoints_px.copy()
    neck = pixels[5:7].mean(axis=0)
    pixels = neck + (pixels - neck) / times
    up = neck_m * np.array([math.sin(lean_rad), -math.cos(lean_rad)])
    pixels[HEAD] += neck + up * WIDE.fx_px / depth_m - pixels[HEAD].mean(axis=0)
    box = np.r_[pixels.min(axis=0), pixels.max(axis=0)]
    leaning = one._replace(
        keypoints=changed(one.keypoints, pixels), detection=PersonDetection(box, 0.9)
    )
    measured = replace(head, range_relative_std=0.07)
    assert reason_of(leaning, measured, WIDE) is None
    # The head of somebody beside them is not.
    moved = pixels.copy()
    moved[HEAD, 0] += 0.6 * WIDE.fx_px / depth_m
    beside = leaning._replace(keypoints=changed(one.keypoints, moved))
    assert reason_of(beside, measured, WIDE) == SHARED_HEAD


@settings(deadline=None, max_examples=40)
@given(st.floats(-0.1, 0.1), st.floats(2.0, 6.0), st.booleans())
def test_a_face_outside_the_box_is_anothers(across_m, depth_m, with_shoulders):
    """A second box over somebody bent begins below the face of somebody behind them."""
    one, head = with_head(depth_m=depth_m)
    one = moved_head(one, across_m, 0.0, depth_m)
    assert reason_of(one, head) is None
    box = one.detection.box_xyxy_px.copy()
    box[1] = one.keypoints.keypoints_px[5:7, 1].mean() - 0.02 * CAMERA.fx_px / depth_m
    scores = one.keypoints.scores.copy()
    scores[5] *= with_shoulders
    second = one._replace(
        detection=PersonDetection(box, 0.9), keypoints=changed(one.keypoints, scores=scores)
    )
    assert reason_of(second, head) == SHARED_HEAD


def test_a_head_that_looks_away_is_left():
    """It is unaware, whoever it belongs to: that is worth more than no evidence."""
    one, head = with_head(body_yaw_rad=math.pi)
    assert reason_of(moved_head(one, 0.3, 0.1, 4.0), head) is None
    one, head = with_head(head_yaw_rad=math.pi)
    assert reason_of(one, head) is None


def test_without_shoulders_nothing_tells_whose_head_it_is():
    one, head = with_head(body_yaw_rad=math.pi, head_yaw_rad=math.pi)
    assert reason_of(one, head) == SHARED_HEAD
    for shoulder in (5, 6):
        scores = one.keypoints.scores.copy()
        scores[shoulder] = 0.0
        hidden = one._replace(keypoints=changed(one.keypoints, scores=scores))
        assert reason_of(hidden, head) is None


def test_people_without_head_or_skeleton_stay_as_they_are():
    person, detection = seen()
    nobody = changed(person, scores=np.zeros(17))
    assert reasons((nobody, detection), (nobody, detection)) == [None, None]
    assert disowned_keypoints(CAMERA, (), (), 0.3) == []
    one, head = with_head(body_yaw_rad=math.pi, head_yaw_rad=math.pi)
    assert reason_of(one, None) is None
    stolen = one._replace(disowned=SKELETON)
    assert own_heads(CAMERA, (stolen,), (head,), 0.3) == ((stolen,), (head,))
    assert own_heads(CAMERA, (), (), 0.3) == ((), ())


# --- in the pipeline ----------------------------------------------------------------------------


@pytest.mark.parametrize(("yaw", "aware"), [(0.0, True), (math.pi, False)], ids=["front", "back"])
def test_a_face_on_the_wall_behind_a_back_gives_no_awareness(yaw, aware):
    one, head = with_head(body_yaw_rad=yaw, head_yaw_rad=-yaw)
    known = Given([one.keypoints], [one.detection], [head])
    (seen_as,) = AwarenessPipeline(CAMERA, known, known, known).process(BLANK, 0.0)
    if aware:
        assert seen_as.awareness > 0.8
        assert seen_as.awareness_reason is None
    else:
        assert (seen_as.awareness, seen_as.gaze_camera) == (None, None)
        assert seen_as.awareness_reason == SHARED_HEAD


def processed(*pairs):
    """Return the observations of a pipeline whose networks found these people and boxes."""
    known = Given(*zip(*pairs, strict=True))
    return AwarenessPipeline(CAMERA, known, known).process(BLANK, 0.0)


def test_only_one_of_two_boxes_has_the_awareness_of_a_skeleton():
    # Yaw π of the test bodies looks at the camera or away; whichever it is, one has an α.
    person, detection = seen()
    neighbour = shifted(detection, (40.0, 0.0))
    second, first = processed((changed(person), neighbour), (person, detection))
    assert first.awareness is not None
    assert first.awareness_reason is None
    assert (second.awareness, second.awareness_std, second.gaze_camera) == (None, None, None)
    assert second.awareness_reason == SKELETON
    # They are placed by the box, with the uncertainty of that across the ray. Along the ray, that
    # of the stature is in both.
    spread = [each.position_covariance_m2[0, 0] for each in (first, second)]
    assert spread[1] > 5.0 * spread[0]
    assert second.position_camera_m[0] > first.position_camera_m[0]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda person: changed(person, scores=np.r_[np.zeros(5), np.ones(12)]), "no head pose"),
        (lambda person: changed(person, scores=np.zeros(17)), "no skeleton"),
        (lambda person: changed(person, person.keypoints_px + np.array([300.0, 0.0])), OUTSIDE),
    ],
    ids=["no face", "nobody", "beside the box"],
)
def test_an_observation_says_why_there_is_no_awareness(change, reason):
    person, detection = seen()
    (seen_as,) = processed((change(person), detection))
    assert seen_as.awareness is None
    assert seen_as.awareness_reason == reason
