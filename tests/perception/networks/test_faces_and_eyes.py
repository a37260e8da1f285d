"""Faces and eyes by the networks of faces: the parts that need no network."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import Camera, HeadPose, PersonDetection, PersonKeypoints
from perception.evidence import judge_face
from perception.networks.faces import FaceMeshPoseEstimator, iris_offset
from perception.networks.faces import _face_scores as face_scores


def turned_head(yaw_rad):
    """Return points of a face (5, 3), x right, y down, z away; positive yaw turns it right."""
    face = np.array(
        [[0, 0, -1.0], [0.3, -0.3, -0.8], [-0.3, -0.3, -0.8], [0.7, 0, 0], [-0.7, 0, 0]]
    )
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return face @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T


@pytest.mark.parametrize("yaw_deg", [0.0, 25.0, 65.0, 90.0])
def test_the_far_side_of_a_turned_face_has_lower_scores(yaw_deg):
    nose, left_eye, right_eye, left_ear, right_ear = face_scores(turned_head(np.deg2rad(yaw_deg)))
    assert (nose, right_eye, right_ear) == (1.0, 1.0, 1.0)
    assert left_ear == pytest.approx(np.clip((40.0 - yaw_deg) / 25.0, 0.0, 1.0))
    assert left_eye == pytest.approx(np.clip((80.0 - yaw_deg) / 30.0, 0.0, 1.0))
    mirrored = face_scores(turned_head(-np.deg2rad(yaw_deg)))
    assert mirrored == pytest.approx([nose, right_eye, left_eye, right_ear, left_ear])


def landmarks(left=(0.0, 0.0), right=(0.0, 0.0), opening=0.03):
    """Return points (478, 2) with eyes 0.1 wide, whose irises lie off the middle of the corners."""
    marks = np.full((478, 2), 0.5)
    for iris, corners, lids, middle, off in (
        (473, (362, 263), (386, 374), (0.6, 0.4), left),
        (468, (133, 33), (159, 145), (0.4, 0.4), right),
    ):
        marks[iris] = np.add(middle, off)
        marks[list(corners)] = np.add(middle, [[-0.05, 0.0], [0.05, 0.0]])
        marks[list(lids)] = np.add(middle, [[0.0, -0.5 * opening], [0.0, 0.5 * opening]])
    return marks


def test_the_offset_is_the_mean_of_both_irises_and_closed_eyes_say_nothing():
    found = iris_offset(landmarks(left=(0.01, -0.002), right=(0.02, 0.004)))
    assert found == pytest.approx([0.015, 0.001])
    for marks in (landmarks(opening=0.01), landmarks(opening=math.nan), landmarks(opening=0.0)):
        assert iris_offset(marks) is None


class Face:
    """A mesh that finds one face, a head's width across."""

    def __init__(self, opening: float) -> None:
        self._marks = np.column_stack([200.0 * landmarks(opening=opening), np.zeros(478)])

    def find(self, *_):
        return self._marks


class Body:
    """A pose network that sees one whole body."""

    def estimate(self, _, detections):
        points = np.random.default_rng(0).uniform(50.0, 150.0, (17, 2))
        points[:5] = (100, 100), (120, 80), (80, 80), (100, 100), (100, 100)  # as the mesh's
        person = PersonKeypoints(points, np.zeros((17, 3)), np.ones(17), "coco", lifted=False)
        return (person,) * len(detections)


@pytest.mark.parametrize(("opening", "reason"), [(0.03, None), (0.01, "eyes covered by lids")])
def test_lids_over_the_irises_leave_no_evidence_of_awareness(opening, reason):
    poses = FaceMeshPoseEstimator(Body(), Face(opening))
    box = PersonDetection([50.0, 50.0, 150.0, 150.0], 1.0)
    (person,) = poses.estimate(np.zeros((480, 640, 3), np.uint8), (box,))
    assert person.face_evidence
    assert person.eyes_open == (reason is None)
    head = HeadPose([0.0, 0.0, 2.0], np.eye(3), 1e-4 * np.eye(6), 0.0)
    camera = Camera.from_fov(640, 480, math.radians(60.0))
    judged = judge_face(camera, person, head, 0.3)
    assert (judged if isinstance(judged, str) else None) == reason
