"""MediaPipe as an estimator of poses and of eyes; tests with the package need its extra."""

from __future__ import annotations

import importlib.util
import json
import math
import re
import sys
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from paths import SHARED

from perception import Camera, HeadPose, PerceptionError, PersonDetection, PoseEstimator
from perception.eyes import EyeEstimator
from perception.installation import install_command
from perception.layouts import NOSE
from perception.networks import MediaPipeEyeEstimator, MediaPipePoseEstimator
from perception.networks.poses._mediapipe import _face_scores
from perception.networks.poses._mediapipe_eyes import iris_offset

IMAGES = SHARED / "images"
TRUTH = IMAGES / "truth_coco_wholebody_mmpose.json"
CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
FRAME = np.zeros((480, 640, 3), np.uint8)
FACING = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], axis=1)
# Height of a head relative to the face from brows to chin, which the labels box.
HEAD_OVER_FACE = 1.75
needs_mediapipe = pytest.mark.skipif(
    importlib.util.find_spec("mediapipe") is None,
    reason="mediapipe is not installed (the extra 'mediapipe')",
)
needs_images = pytest.mark.skipif(not TRUTH.is_file(), reason="no photographs beside the checkout")


@pytest.mark.parametrize("make", [MediaPipePoseEstimator, MediaPipeEyeEstimator])
def test_a_broken_package_is_refused_with_the_name_of_the_extra(make, monkeypatch):
    monkeypatch.setitem(sys.modules, "mediapipe", None)
    monkeypatch.setitem(sys.modules, "mediapipe.python.solutions", None)
    with pytest.raises(PerceptionError, match=re.escape(install_command("mediapipe"))):
        make()


def turned_head(yaw_rad):
    """Return points of a face (5, 3), x right, y down, z away; positive yaw turns it right."""
    face = np.array(
        [[0, 0, -1.0], [0.3, -0.3, -0.8], [-0.3, -0.3, -0.8], [0.7, 0, 0], [-0.7, 0, 0]]
    )
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return face @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T


@pytest.mark.parametrize("yaw_deg", [0.0, 25.0, 65.0, 90.0])
def test_the_far_side_of_a_turned_face_has_lower_scores(yaw_deg):
    nose, left_eye, right_eye, left_ear, right_ear = _face_scores(turned_head(np.deg2rad(yaw_deg)))
    assert (nose, right_eye, right_ear) == (1.0, 1.0, 1.0)
    assert left_ear == pytest.approx(np.clip((40.0 - yaw_deg) / 25.0, 0.0, 1.0))
    assert left_eye == pytest.approx(np.clip((80.0 - yaw_deg) / 30.0, 0.0, 1.0))
    mirrored = _face_scores(turned_head(-np.deg2rad(yaw_deg)))
    assert mirrored == pytest.approx([nose, right_eye, left_eye, right_ear, left_ear])


def landmarks(left=(0.0, 0.0), right=(0.0, 0.0), opening=0.03):
    """Return 478 landmarks with eyes 0.1 wide, whose irises lie off the middle of the corners."""
    marks = [SimpleNamespace(x=0.5, y=0.5) for _ in range(478)]
    for iris, corners, lids, middle, off in (
        (473, (362, 263), (386, 374), (0.6, 0.4), left),
        (468, (133, 33), (159, 145), (0.4, 0.4), right),
    ):
        marks[iris] = SimpleNamespace(x=middle[0] + off[0], y=middle[1] + off[1])
        for row, side in zip(corners, (-0.05, 0.05), strict=True):
            marks[row] = SimpleNamespace(x=middle[0] + side, y=middle[1])
        for row, side in zip(lids, (-0.5, 0.5), strict=True):
            marks[row] = SimpleNamespace(x=middle[0], y=middle[1] + side * opening)
    return marks


def test_the_offset_is_the_mean_of_both_irises_and_closed_eyes_say_nothing():
    found = iris_offset(landmarks(left=(0.01, -0.002), right=(0.02, 0.004)))
    assert found == pytest.approx([0.015, 0.001])
    for marks in (landmarks(opening=0.01), landmarks((math.nan, 0.0)), landmarks(opening=0.0)):
        assert iris_offset(marks) is None


# --- with MediaPipe: poses ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def poses():
    with MediaPipePoseEstimator() as opened:
        yield opened


@needs_mediapipe
@pytest.mark.parametrize("box", [[0, 0, 640, 480], [10, 10, 10, 10], [600, 400, 700, 500]])
def test_a_box_without_a_person_gives_scores_of_0(poses, box):
    assert isinstance(poses, PoseEstimator)
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    (person,) = poses.estimate(image, (PersonDetection(box, 0.5),))
    assert not person.scores.any()
    assert not person.face_evidence


@needs_mediapipe
@needs_images
def test_faces_agree_with_the_labels_and_no_other_face_is_evidence(poses):
    truth = json.loads(TRUTH.read_text())
    files = {image["id"]: IMAGES / f"coco_{image['file_name']}" for image in truth["images"]}
    errors, faces = [], 0
    for person in truth["annotations"]:
        image = cv2.cvtColor(cv2.imread(str(files[person["image_id"]])), cv2.COLOR_BGR2RGB)
        labels = np.array(person["keypoints"], dtype=float).reshape(-1, 3)[:5]
        left, top, width, height = person["bbox"]
        box = PersonDetection([left, top, left + width, top + height], 1.0)
        (found,) = poses.estimate(image, (box,))
        if found.face_evidence:
            faces += 1
            assert (labels[:3, 2] == 2).all()
        if person["face_valid"]:
            assert found.face_evidence
            head_px = HEAD_OVER_FACE * person["face_box"][3]
            error = np.linalg.norm(found.keypoints_px[:5] - labels[:, :2], axis=1) / head_px
            errors.extend(error[labels[:, 2] == 2])
            # An ear without a label must have a low score.
            assert (found.scores[:5][labels[:, 2] == 0] < 0.5).all()
            # From the middle of the hips, y down.
            assert np.abs(found.keypoints_root_m[11:13].mean(axis=0)).max() < 0.02
            assert found.keypoints_root_m[NOSE, 1] < found.keypoints_root_m[5:7, 1].min()
    assert faces >= 5
    assert len(errors) >= 15
    assert max(errors) <= 0.12


# --- with MediaPipe: eyes -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def eyes():
    with MediaPipeEyeEstimator() as opened:
        yield opened


def head_at(distance_m, yaw_deg=0.0):
    angle = math.radians(yaw_deg)
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    return HeadPose([0.0, 0.0, distance_m], turn @ FACING, 1e-3 * np.eye(6), 0.5)


@needs_mediapipe
def test_it_is_an_eye_estimator_and_far_or_turned_heads_cost_no_run(eyes, monkeypatch):
    assert isinstance(eyes, EyeEstimator)
    assert eyes.estimate(FRAME, CAMERA, (None, head_at(1.5))) == (None, None)
    monkeypatch.setattr(eyes, "_mesh", object())  # has no method to run
    away = (head_at(3.0), head_at(1.5, yaw_deg=60.0), head_at(1.5, 180.0))
    assert eyes.estimate(FRAME, CAMERA, away) == (None,) * 3


@needs_mediapipe
@pytest.mark.parametrize(
    ("make", "rest"), [(MediaPipePoseEstimator, ()), (MediaPipeEyeEstimator, (CAMERA,))]
)
def test_a_closed_estimator_and_anything_but_an_rgb_image_are_refused(make, rest):
    estimator = make()
    with pytest.raises(PerceptionError, match="image_rgb"):
        estimator.estimate(FRAME[..., 0], *rest, ())
    estimator.close()
    estimator.close()
    with pytest.raises(PerceptionError, match="closed"):
        estimator.estimate(FRAME, *rest, ())


@needs_mediapipe
@pytest.mark.parametrize("look", ["giulia", "daniel"])
def test_eyes_of_a_rendered_worker_are_measured(eyes, look):
    sim = pytest.importorskip("sim_tests")
    pytest.importorskip("pybullet")
    turns = np.radians([-16.0, 0.0, 16.0])
    with sim.Warehouse() as warehouse:
        worker = sim.Worker(warehouse, look=look)
        renderer = sim.CameraRenderer(warehouse)
        found, scores = [], []
        for turn in turns:
            worker.place((1.2, 0.0), math.pi, eye_yaw_rad=float(turn))
            camera_z = float(worker.eyes_odom_m[2])
            T_odom_camera = np.array(
                [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, camera_z], [0, 0, 0, 1]], dtype=float
            )
            rotation = T_odom_camera[:3, :3].T @ worker.rotation_odom_head
            nose = (worker.keypoints_odom_m[0] - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]
            head = HeadPose(nose, rotation, 1e-6 * np.eye(6), 0.5)
            image = renderer.render(CAMERA, T_odom_camera).rgb
            (seen,) = eyes.estimate(image, CAMERA, (head,))
            assert seen is not None
            found.append(seen.angles_rad[0])
            scores.append((seen.angles_rad[0] - turn) ** 2 / seen.covariance_rad2[0, 0])
    assert np.corrcoef(found, turns)[0, 1] > 0.95
    assert 0.5 < np.polyfit(turns, found, 1)[0] < 1.5
    assert max(scores) < 9.0
