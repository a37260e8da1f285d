"""A face that the mesh has found counts only on the head that the pose network has found."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from perception import PersonKeypoints
from perception.anthropometry import HEAD_TEMPLATE_M
from perception.arrays import FloatArray
from perception.networks.faces import FaceMeshPoseEstimator

IMAGE = np.zeros((480, 640, 3), np.uint8)
PX_PER_M = 250.0
# Points of the mesh about nose, eyes and ears, and the lids.
ROWS = ((1,), (362, 263), (33, 133), (454, 323), (234, 93))
LIDS = ((386, -3.0), (374, 3.0), (159, -3.0), (145, 3.0))


def head_px(yaw_rad: float, size: float = 1.0) -> np.ndarray:
    """Nose, eyes and ears (5, 2) of a head that is turned by a yaw off the camera."""
    down, forward, right = HEAD_TEMPLATE_M.T
    across = -right * math.cos(yaw_rad) + forward * math.sin(yaw_rad)
    return size * PX_PER_M * np.column_stack([across, down]) + (320.0, 120.0)


class Mesh:
    """Finds one face wherever it looks."""

    def __init__(self, yaw_rad: float, aside_px: FloatArray | float = 0.0) -> None:
        points = head_px(yaw_rad, 0.95) + aside_px
        self.marks = np.zeros((478, 3))
        self.marks[:, :2] = points.mean(axis=0)
        for rows, point in zip(ROWS, points, strict=True):
            self.marks[list(rows), :2] = point
        for corner, side in ((362, 4.0), (263, -4.0), (133, 4.0), (33, -4.0)):
            self.marks[corner, 0] += side
        for (row, down), eye in zip(LIDS, points[[1, 1, 2, 2]], strict=True):
            self.marks[row, :2] = eye[0], eye[1] + down

    def find(self, image_rgb, centre_px, side_px, farthest_px):
        return self.marks


class Pose:
    """A body that faces the camera, with a head that is turned by a yaw."""

    def __init__(self, yaw_rad: float) -> None:
        pixels = np.zeros((17, 2))
        pixels[:5] = head_px(yaw_rad)
        pixels[5:] = (320.0, 250.0)
        pixels[5:7, 0] += (45.0, -45.0)
        pixels[11:13] = (330.0, 300.0), (310.0, 300.0)
        self.person = PersonKeypoints(
            pixels, np.zeros((17, 3)), np.ones(17), "coco", face_evidence=False
        )

    def estimate(self, image_rgb, detections):
        return (self.person,)


def found(head_rad: float, face_rad: float, aside_px: FloatArray | float = 0.0) -> PersonKeypoints:
    mesh = Mesh(face_rad, aside_px)
    (person,) = FaceMeshPoseEstimator(Pose(head_rad), mesh).estimate(IMAGE, ())
    return person


@settings(deadline=None)
@given(st.floats(-0.6, 0.6), st.floats(-0.2, 0.2))
def test_a_face_that_is_turned_as_the_head_is_its_own(yaw_rad, off_rad):
    person = found(yaw_rad, yaw_rad + off_rad)
    assert person.face_evidence
    assert person.face_points_m is not None
    np.testing.assert_allclose(person.keypoints_px[:5], head_px(yaw_rad + off_rad, 0.95))


@settings(deadline=None)
@given(st.floats(1.2, 1.75), st.floats(-0.3, 0.3), st.sampled_from([-1.0, 1.0]))
def test_a_face_that_looks_here_over_a_profile_is_none(yaw_rad, face_rad, side):
    person = found(side * yaw_rad, side * face_rad)
    assert not person.face_evidence
    assert person.face_points_m is None
    assert person.irises_px is None
    np.testing.assert_array_equal(person.keypoints_px[:5], head_px(side * yaw_rad))


@settings(deadline=None)
@given(st.floats(-0.6, 0.6), st.floats(0.0, 1.0), st.floats(-math.pi, math.pi))
def test_a_face_beside_the_nose_and_eyes_of_the_head_is_none(yaw_rad, sizes, way_rad):
    """The mesh lays one that looks here over a profile that the pose network takes for a face."""
    size_px = float(np.linalg.norm(np.subtract(*head_px(yaw_rad, 0.95)[3:])))
    aside_px = sizes * size_px * np.array([math.cos(way_rad), math.sin(way_rad)])
    person = found(yaw_rad, yaw_rad, aside_px)
    if not 0.25 <= sizes <= 0.45:
        assert person.face_evidence == (sizes < 0.35)
