"""Whose keypoints: one skeleton for each detection, and only one that a body could have."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_people import Given, person_at

from perception import (
    AwarenessPipeline,
    Camera,
    PersonDetection,
    PersonKeypoints,
)
from perception.layouts import HEAD
from perception.ownership import DISOWNED, disowned_keypoints, without_disowned

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


def test_people_without_keypoints_lose_nothing():
    person, detection = seen()
    nobody = changed(person, scores=np.zeros(17))
    assert reasons((nobody, detection), (nobody, detection)) == [None, None]
    assert disowned_keypoints(CAMERA, (), (), 0.3) == []


# --- in the pipeline ----------------------------------------------------------------------------


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
        (lambda person: changed(person, person.keypoints_px + np.array([300.0, 0.0])), OUTSIDE),
    ],
    ids=["no face", "beside the box"],
)
def test_an_observation_says_why_there_is_no_awareness(change, reason):
    person, detection = seen()
    (seen_as,) = processed((change(person), detection))
    assert seen_as.awareness is None
    assert seen_as.awareness_reason == reason
