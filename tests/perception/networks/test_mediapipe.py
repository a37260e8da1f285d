"""MediaPipe as a pose estimator; most tests need the extra and photographs."""

from __future__ import annotations

import importlib.util
import json
import re
import sys

import cv2
import numpy as np
import pytest
from paths import SHARED

from perception import PerceptionError, PersonDetection, PersonKeypoints, PoseEstimator
from perception.installation import install_command
from perception.layouts import LEFT_ANKLE, LEFT_SHOULDER, NOSE, RIGHT_ANKLE, RIGHT_SHOULDER
from perception.networks import MediaPipePoseEstimator
from perception.networks.poses._mediapipe import _cropped, _face_scores, _in_image

IMAGES = SHARED / "images"
TRUTH = IMAGES / "truth_coco_wholebody_mmpose.json"

HAS_MEDIAPIPE = importlib.util.find_spec("mediapipe") is not None
needs_mediapipe = pytest.mark.skipif(
    not HAS_MEDIAPIPE, reason="mediapipe is not installed (the extra 'mediapipe')"
)
needs_images = pytest.mark.skipif(not TRUTH.is_file(), reason="no photographs beside the checkout")
# Height of a head relative to the face from brows to chin, which the labels box.
HEAD_OVER_FACE = 1.75


@pytest.fixture(scope="module")
def estimator():
    with MediaPipePoseEstimator() as opened:
        yield opened


@pytest.fixture(scope="module")
def photographs():
    """Return each labelled person with the image that shows them."""
    truth = json.loads(TRUTH.read_text())
    files = {image["id"]: f"coco_{image['file_name']}" for image in truth["images"]}
    images = {
        key: cv2.cvtColor(cv2.imread(str(IMAGES / name)), cv2.COLOR_BGR2RGB)
        for key, name in files.items()
    }
    return [(images[person["image_id"]], person) for person in truth["annotations"]]


def detection(person):
    left, top, width, height = person["bbox"]
    return PersonDetection([left, top, left + width, top + height], 1.0)


def labelled(person):
    return np.array(person["keypoints"], dtype=float).reshape(-1, 3)


def test_a_broken_package_is_refused_with_the_name_of_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "mediapipe", None)
    monkeypatch.setitem(sys.modules, "mediapipe.python.solutions", None)
    with pytest.raises(PerceptionError, match=re.escape(install_command("mediapipe"))):
        MediaPipePoseEstimator()


def turned_head(yaw_rad):
    """Return points of a face (5, 3), x right, y down, z away; positive yaw turns it right."""
    face = np.array(
        [[0, 0, -1.0], [0.3, -0.3, -0.8], [-0.3, -0.3, -0.8], [0.7, 0, 0], [-0.7, 0, 0]]
    )
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return face @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]).T


@pytest.mark.parametrize("yaw_deg", [0.0, 25.0, 40.0, 65.0, 90.0])
def test_the_far_side_of_a_turned_face_has_lower_scores(yaw_deg):
    to_the_right = turned_head(np.deg2rad(yaw_deg))
    if yaw_deg:
        assert to_the_right[0, 0] > 0.0  # the nose
    nose, left_eye, right_eye, left_ear, right_ear = _face_scores(to_the_right)
    assert (nose, right_eye, right_ear) == (1.0, 1.0, 1.0)
    assert left_ear == pytest.approx(np.clip((40.0 - yaw_deg) / 25.0, 0.0, 1.0))
    assert left_eye == pytest.approx(np.clip((80.0 - yaw_deg) / 30.0, 0.0, 1.0))
    mirrored = _face_scores(turned_head(-np.deg2rad(yaw_deg)))
    assert mirrored == pytest.approx([nose, right_eye, left_eye, right_ear, left_ear])


def test_points_of_a_crop_are_mapped_to_pixel_centres_of_the_image():
    image = np.zeros((40, 60, 3), np.uint8)
    crop, corner = _cropped(image, np.array([-5.0, 10.0, 30.2, 90.0]))
    assert crop.shape == (30, 30, 3)
    # The corner of the first pixel lies half a pixel before its centre.
    assert _in_image(np.array([[0.0, 0.0], [1.0, 1.0]]), crop, corner).tolist() == [
        [-0.5, 9.5],
        [29.5, 39.5],
    ]
    assert _cropped(image, np.array([100.0, 0.0, 200.0, 40.0]))[0] is None
    assert _cropped(image, np.array([5.0, 5.0, 5.0, 5.0]))[0] is None


# --- with MediaPipe -----------------------------------------------------------------------------


@needs_mediapipe
def test_it_is_a_pose_estimator(estimator):
    assert isinstance(estimator, PoseEstimator)
    assert estimator.estimate(np.zeros((48, 64, 3), np.uint8), ()) == ()


@needs_mediapipe
@pytest.mark.parametrize(
    "box",
    [[0, 0, 640, 480], [10, 10, 10, 10], [-50, -50, -10, -10], [600, 400, 700, 500], [3, 3, 7, 9]],
)
def test_a_box_without_a_person_gives_scores_of_0(estimator, box):
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    (person,) = estimator.estimate(image, (PersonDetection(box, 0.5),))
    assert isinstance(person, PersonKeypoints)
    assert not person.scores.any()
    assert not person.face_evidence


@needs_mediapipe
@pytest.mark.parametrize(
    "image",
    [
        np.zeros((48, 64), np.uint8),
        np.zeros((48, 64, 3), np.float32),
        np.zeros((0, 64, 3), np.uint8),
        np.zeros((48, 64, 4), np.uint8),
        None,
    ],
)
def test_anything_but_an_rgb_image_is_refused(estimator, image):
    with pytest.raises(PerceptionError, match="image_rgb"):
        estimator.estimate(image, (PersonDetection([0, 0, 10, 10], 0.5),))


@needs_mediapipe
def test_a_closed_estimator_is_refused():
    closed = MediaPipePoseEstimator()
    closed.close()
    closed.close()
    with pytest.raises(PerceptionError, match="closed"):
        closed.estimate(np.zeros((8, 8, 3), np.uint8), ())


@needs_mediapipe
@needs_images
def test_faces_agree_with_the_labels(estimator, photographs):
    errors = []
    for image, person in photographs:
        labels = labelled(person)
        if not person["face_valid"]:
            continue
        (found,) = estimator.estimate(image, (detection(person),))
        assert found.face_evidence
        head_px = HEAD_OVER_FACE * person["face_box"][3]
        error = np.linalg.norm(found.keypoints_px[:5] - labels[:5, :2], axis=1) / head_px
        visible = labels[:5, 2] == 2
        errors.extend(error[visible])
        # An ear without a label must have a low score.
        assert (found.scores[:5][labels[:5, 2] == 0] < 0.5).all()
    assert len(errors) >= 15
    assert max(errors) <= 0.12


@needs_mediapipe
@needs_images
def test_face_evidence_is_given_only_where_a_face_is_labelled(estimator, photographs):
    """The labels have nose and both eyes, near the estimated ones."""
    faces = 0
    for image, person in photographs:
        (found,) = estimator.estimate(image, (detection(person),))
        if not found.face_evidence:
            continue
        faces += 1
        labels = labelled(person)
        assert (labels[:3, 2] == 2).all()
        shoulders = np.linalg.norm(labels[LEFT_SHOULDER, :2] - labels[RIGHT_SHOULDER, :2])
        error = np.linalg.norm(found.keypoints_px[:3] - labels[:3, :2], axis=1)
        assert error.max() <= 0.25 * shoulders
    assert faces >= 5


@needs_mediapipe
@needs_images
def test_the_skeleton_has_camera_axes(estimator, photographs):
    image, person = max(photographs, key=lambda pair: labelled(pair[1])[:17, 2].min())
    (found,) = estimator.estimate(image, (detection(person),))
    root = found.keypoints_root_m
    assert np.abs(root[11:13].mean(axis=0)).max() < 0.02  # from the middle of the hips
    assert root[NOSE, 1] < root[[LEFT_SHOULDER, RIGHT_SHOULDER], 1].min()  # y down
    assert root[[LEFT_ANKLE, RIGHT_ANKLE], 1].min() > 0.4
    pixels = found.keypoints_px - found.keypoints_px[11:13].mean(axis=0)
    body = slice(5, 17)
    assert np.corrcoef(root[body, 0], pixels[body, 0])[0, 1] > 0.8  # x right
    assert root[NOSE, 2] < root[[3, 4], 2].mean()  # z away: the person faces the camera
