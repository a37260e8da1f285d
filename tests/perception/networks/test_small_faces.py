"""A small face is evidence only on the head that the pose network has found, looking here."""

from __future__ import annotations

import io
import math
import os
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_face_agreement import IMAGE, Pose, head_px

from perception import PerceptionError
from perception.networks.faces import FaceMeshPoseEstimator
from perception.networks.small_faces import RetinaFace

ANGLES = st.floats(-0.4, 0.4)


class Blind:
    """A mesh that finds no face."""

    def find(self, image_rgb, centre_px, side_px, farthest_px):
        return None


class Small:
    """Finds one face of a yaw, so far off the head (px); None finds nothing."""

    def __init__(self, yaw_rad, off_px=(0.0, 0.0)):
        self.points = None
        if yaw_rad is not None:
            nose, left, right = head_px(yaw_rad)[:3] + off_px
            self.points = np.stack([right, left, nose, right, left])

    def find(self, image_rgb, centre_px, side_px, farthest_px):
        return self.points


def seen(head_rad, small):
    pose = Pose(head_rad)
    (person,) = FaceMeshPoseEstimator(pose, Blind(), small).estimate(IMAGE, ())
    np.testing.assert_array_equal(person.keypoints_px, pose.person.keypoints_px)
    assert person.face_points_m is None
    return person.face_evidence


@settings(deadline=None)
@given(ANGLES, ANGLES, st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)))
def test_a_small_face_on_its_head_is_evidence(yaw_rad, turned_rad, off_px):
    assert seen(yaw_rad, Small(yaw_rad + 0.25 * turned_rad, off_px))


@settings(deadline=None)
@given(ANGLES, st.floats(0.0, 2.0 * math.pi), st.floats(25.0, 80.0))
def test_a_face_beside_the_head_is_anothers(yaw_rad, way_rad, away_px):
    off_px = away_px * np.array([math.cos(way_rad), math.sin(way_rad)])
    assert not seen(yaw_rad, Small(yaw_rad, off_px))


@settings(deadline=None)
@given(st.floats(0.65, 1.6), ANGLES, st.sampled_from([-1.0, 1.0]))
def test_profiles_and_backs_get_no_face_that_looks_here(yaw_rad, face_rad, side):
    assert not seen(side * yaw_rad, Small(side * yaw_rad))
    # From behind, the pose network has the left eye at the left.
    assert not seen(math.pi - side * face_rad, Small(face_rad))


@given(st.sampled_from([5, 6]), st.floats(0.0, 0.29))
def test_without_both_shoulders_nothing_tells_whose_face_it_is(shoulder, score):
    pose, small = Pose(0.0), Small(0.0)
    assert FaceMeshPoseEstimator(pose, Blind(), small).estimate(IMAGE, ())[0].face_evidence
    scores = pose.person.scores.copy()
    scores[shoulder] = score
    pose.person = replace(pose.person, scores=scores)
    assert not FaceMeshPoseEstimator(pose, Blind(), small).estimate(IMAGE, ())[0].face_evidence


@given(st.floats(math.radians(70.0), math.radians(290.0)))
def test_a_small_face_over_a_body_that_does_not_face_here_is_none(turned_rad):
    pose, small = Pose(0.0), Small(0.0)
    pixels = pose.person.keypoints_px.copy()
    pixels[5:7, 0] = 320.0 + 45.0 * math.cos(turned_rad) * np.array([1.0, -1.0])
    pixels[11:13, 1] += 80.0  # the torso keeps the body's size
    pose.person = replace(pose.person, keypoints_px=pixels)
    assert not FaceMeshPoseEstimator(pose, Blind(), small).estimate(IMAGE, ())[0].face_evidence


@pytest.mark.parametrize("small", [None, Small(None)])
def test_without_a_small_face_there_is_no_evidence(small):
    assert not seen(0.0, small)


class Command:
    def __reduce__(self):
        return os.system, ("exit 3",)


def test_a_checkpoint_is_read_without_running_anything():
    file = io.BytesIO()
    for part in (0x1950A86A20F9469CFC6C, 1001, {}, Command()):
        pickle.dump(part, file, protocol=2)
    with pytest.raises(PerceptionError, match="is no part of a network's weights"):
        RetinaFace(file.getvalue())
