"""Refusals of perception, each with a message that names the value and what is valid."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from perception import (
    AttentionCone,
    AwarenessPipeline,
    Camera,
    FloorPlane,
    HeadPose,
    OnnxPersonDetector,
    PerceptionError,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
    PnpHeadPoseEstimator,
)
from perception.anthropometry import HEAD_TEMPLATE_M
from perception.confirmation import KeypointConfirmation
from perception.eyes import EyeGaze, eyes_from_irises
from perception.head_frame import printed_head_rotation
from perception.laser import (
    LaserScan,
    LegDetector,
    LegDetectorConfig,
    PersonCandidate,
    RobotMotion,
    Scanner,
    StaticMap,
    observations_of,
)
from perception.networks import OnnxModel, OnnxSettings, rgb_image
from perception.networks.faces import FaceMesh
from perception.networks.heads import head_crop
from perception.networks.small_faces import RetinaFace
from perception.no_view import why_no_view
from perception.shipped import (
    DETECTOR,
    shipped_head_pose_estimator,
    shipped_model_path,
    shipped_pose_estimator,
)
from perception.surround import (
    FisheyeLens,
    FlatView,
    PanoramaLens,
    SurroundPipeline,
    merge_views,
    ring_of_views,
)

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
UP = [0.0, -1.0, 0.0]
NAN, INF = math.nan, math.inf
HEAD = HeadPose([0, 0, 1], np.eye(3), np.eye(6), 0.0)
RING = ring_of_views(CAMERA, [0.0, 1.0])
SHIPPED = shipped_model_path(DETECTOR)


class Still:
    """A detector, and an estimator of everything else, that finds nobody."""

    def detect(self, image_rgb: Any) -> tuple[()]:
        return ()

    def estimate(self, image_rgb: Any, *given: Any) -> tuple[()]:
        return ()


def pipeline(**options: Any) -> AwarenessPipeline:
    return AwarenessPipeline(CAMERA, Still(), Still(), **options)


def processed(image: Any, stamp_s: float = 0.0, **options: Any) -> object:
    return pipeline().process(image, stamp_s, **options)


def camera(**change: Any) -> Camera:
    fields = {
        "width_px": 640, "height_px": 480, "fx_px": 500.0, "fy_px": 500.0, "cx_px": 320.0,
        "cy_px": 240.0,
    }  # fmt: skip
    return Camera(**(fields | change))


def observation(**change: Any) -> PersonObservation:
    fields = {
        "stamp_s": 0.0, "position_camera_m": [0, 0, 1], "position_covariance_m2": np.eye(3),
        "gaze_camera": None, "awareness": None, "awareness_std": None, "score": 1.0,
    }  # fmt: skip
    return PersonObservation(**(fields | change))


def scan(**change: Any) -> LaserScan:
    fields = {
        "stamp_s": 0.0, "angle_min_rad": -math.pi, "angle_increment_rad": 0.01,
        "ranges_m": [1.0, 2.0, 3.0], "range_min_m": 0.1, "range_max_m": 10.0,
    }  # fmt: skip
    return LaserScan(**(fields | change))


def candidate(**change: Any) -> PersonCandidate:
    fields = {
        "stamp_s": 1.0, "position_odom_m": (0.0, 0.0), "covariance_m2": np.eye(2), "score": 0.9,
        "kind": "two_legs",
    }  # fmt: skip
    return PersonCandidate(**(fields | change))


def lens(*coefficients: float, **options: Any) -> FisheyeLens:
    given = np.array(coefficients) if coefficients else None
    return FisheyeLens(1000, 1000, 250.0, 250.0, 500.0, 500.0, given, **options)


def detector(**options: Any) -> OnnxPersonDetector:
    return OnnxPersonDetector(SHIPPED, **options)


def surround(views: Any = RING) -> SurroundPipeline:
    return SurroundPipeline(PanoramaLens(360, 180), views, lambda each: pipeline())


Refused = tuple[Callable[[], object], str]
CONE = AttentionCone()
FRAME = np.zeros((480, 640, 3), np.uint8)

TYPES: list[Refused] = [
    (lambda: CONE.score([0, 0, 0], [0, 0, 0], [1, 0, 0]), "gaze"),
    (lambda: CONE.score([0, 0, 0], [1, 0, 0], [NAN, 0, 0]), "target_m"),
    (lambda: CONE.score(np.zeros((3, 3)), np.ones((3, 3)), np.ones((4, 3))), "equal lengths"),
    (lambda: CONE.score([0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]), "up"),
    (lambda: CONE.score_of((0, 0, 0), (0, 0, 0), (1, 0, 0)), "length 0"),
    *((lambda angle=angle: AttentionCone(angle), "half_angle_rad") for angle in (0.0, 1.6, NAN)),
    *(
        (lambda pair=pair: AttentionCone(raised_rad=pair), "raised_rad")
        for pair in ((0.3, 0.2), (-0.1, 0.3), (0.1, 1.6), (0.1, NAN))
    ),
    (lambda: Camera.from_fov(640, 480, 90), r"got 90; is it in degrees\?"),
    (lambda: why_no_view(FRAME, FRAME), "LastFrames.*got ndarray"),
    (lambda: camera(fx_px=0.0), "fx_px"),
    (lambda: camera(fy_px=5e-324), r"fy_px must lie in \[1e-06, 1e\+09\], got 4.94066e-324"),
    (lambda: camera(width_px=0), "width_px"),
    (lambda: camera(distortion=[1.0, 2.0, 3.0]), "coefficients"),
    (lambda: CAMERA.normalise([[NAN, 1.0]]), "pixels_px must be finite"),
    (lambda: FloorPlane([0.0, -2.0, 0.0], 1.0), "unit vector"),
    (lambda: FloorPlane(UP, 0.0), "height_m"),
    (lambda: FloorPlane(UP, 1.0, -0.1), "height_std_m"),
    (lambda: FloorPlane.from_pose(np.eye(4)), "above the floor"),
    (lambda: FloorPlane.from_pose(np.eye(3)), "T_odom_camera"),
    (lambda: PersonDetection([10, 0, 5, 5], 0.5), "right >= left"),
    (lambda: PersonKeypoints(*[np.zeros((17, 2))] * 3, "halpe"), "layout"),
    (lambda: PersonKeypoints(*[np.zeros((17, 2))] * 3, "coco_wholebody"), r"\(133,\)"),
    (lambda: HeadPose([0, 0, 1], np.diag([1, 1, -1]), np.eye(6), 0.0), "rotation_camera_head"),
    (lambda: observation(position_camera_m=[0, NAN, 1]), "position_camera_m"),
    (lambda: observation(position_covariance_m2=-np.eye(3)), "semi-definite"),
    (lambda: observation(gaze_camera=[0, 0, 2]), "unit vector"),
    (lambda: observation(awareness=1.2, awareness_std=0.1), "awareness"),
    (lambda: observation(awareness=0.5), "awareness_std"),
    (lambda: observation(awareness_reason="asleep"), "awareness_reason must be one of"),
    (lambda: observation(size_range_m=2.0), "size_range_m and size_range_relative_std"),
    (lambda: observation(score="high"), "score"),
    (lambda: EyeGaze([0.0], np.eye(2)), "angles_rad"),
    (lambda: EyeGaze([2.0, 0.0], np.eye(2)), "within ±π/2"),
    (lambda: EyeGaze([0.0, 0.0], -np.eye(2)), "covariance_rad2"),
]
STAGES: list[Refused] = [
    (lambda: processed(None), "NoneType"),
    (lambda: processed(np.zeros((480, 640), np.uint8)), "shape"),
    (lambda: processed(np.zeros((240, 320, 3), np.uint8)), r"\(480, 640, 3\)"),
    (lambda: processed(FRAME, NAN), "stamp_s"),
    (lambda: processed(FRAME, floor="z = 0"), "floor must be a FloorPlane"),
    (lambda: pipeline(robot_points_camera_m=np.empty((0, 3))), "robot_points_camera_m"),
    (lambda: pipeline(floor=1.2), "floor must be a FloorPlane"),
    (lambda: pipeline(eye_in_head_std_rad=(0.1, 0.1, 0.1)), "eye_in_head_std_rad"),
    (lambda: pipeline(keypoint_std_px=0.0), "keypoint_std_px"),
    (lambda: pipeline(min_score=1.5), "min_score"),
    (lambda: pipeline(detect_every_s=0.21), "detect_every_s"),
    (lambda: KeypointConfirmation(1.5), "score_threshold"),
    (lambda: KeypointConfirmation(neutral=-0.1), "neutral must lie in"),
    (lambda: PnpHeadPoseEstimator(head_model="printed"), "head_model must be 'template'"),
    (lambda: printed_head_rotation(HEAD_TEMPLATE_M, [0.0, 0.0, 1.0]), "must span a frame"),
    (lambda: eyes_from_irises([NAN, 0], np.eye(3), HEAD, iris_std_m=(1e-3, 1e-3)), "offset_m"),
    (lambda: lens(-0.5, 0, 0, 0), r"must grow up to max_angle_rad = 1\.7"),
    (lambda: lens(max_angle_rad=4.0), r"max_angle_rad must lie in \(0, pi\], got 4 rad"),
    (lambda: PanoramaLens(3.5, 2), "whole number of pixels"),
    (lambda: FlatView(CAMERA, np.diag([1.0, 1.0, -1.0])), "rotation"),
    (lambda: ring_of_views(CAMERA, []), "at least one heading"),
    (lambda: merge_views(RING, [[]]), r"one list of observations per view \(2\), got 1"),
    (lambda: surround(()), "at least one view"),
    (lambda: surround().process(FRAME, 0.0), r"\(180, 360, 3\), got uint8 of shape \(480"),
]
NETWORKS: list[Refused] = [
    (lambda: detector(score_threshold=1.5), r"score_threshold must lie in \[0, 1\], got 1.5"),
    (lambda: detector(person_class=3), r"person_class must lie in \[0, 0\]"),
    (lambda: detector(family="yolo"), "family must be one of 'rtmdet', 'yolox', 'ultralytics'"),
    (lambda: detector(input_size_hw_px=320), "two whole numbers"),
    (lambda: head_crop(FRAME, (320.0, 240.0), 0.0), "side_px"),
    (lambda: OnnxModel.shipped("face"), "'face'.*'person_detector'"),
    (lambda: FaceMesh(b"no ZIP archive"), r"not MediaPipe's face_landmarker\.task"),
    *(
        (lambda file=file: RetinaFace(file), r"mobilenet0\.25_Final\.pth")
        for file in (b"", b"no pickle", pickle.dumps(1, 2), pickle.dumps([], 2))
    ),
    (lambda: OnnxModel(b"", sha256="g" * 64), "64 hexadecimal digits"),
    (lambda: OnnxModel(b"", sha256=7), "64 hexadecimal digits"),
    (lambda: OnnxSettings(()), "providers must be one or more of 'cpu', 'cuda', 'tensorrt'"),
    (lambda: OnnxSettings(("cpu", ("CPUExecutionProvider", {}))), "each once"),
    (lambda: OnnxSettings((("gpu", {}),)), "got .*'gpu'"),
    (lambda: OnnxSettings((("cpu", {}, {}),)), "a pair of name and options, got"),
    (lambda: OnnxSettings("gpu"), "got 'gpu'"),
    (lambda: OnnxSettings(intra_op_threads=0), "at least 1 or None, got 0"),
    (lambda: OnnxSettings(intra_op_threads=True), "got True"),
    (lambda: rgb_image(np.zeros((4, 4), np.uint8)), "cvtColor"),
    (lambda: rgb_image(np.zeros((4, 4, 4), np.uint8)), "fourth channel"),
    (lambda: rgb_image(np.zeros((4, 4, 3), np.float32)), "got float32"),
    (lambda: rgb_image(np.zeros((1, 40000, 3), np.uint8)), "got 40000 x 1"),
    (lambda: detector().detect(None), "image_rgb must be .* got NoneType"),
    (lambda: shipped_pose_estimator().estimate(None, ()), "image_rgb must"),
    (lambda: shipped_head_pose_estimator().estimate(None, CAMERA, ()), "image_rgb must"),
]
LASER: list[Refused] = [
    (lambda: scan(ranges_m=[]), "at least one range"),
    (lambda: scan(angle_increment_rad=0.0), "must not be 0"),
    (lambda: scan(range_max_m=0.1), "must exceed range_min_m"),
    (lambda: scan(range_min_m=-1.0), "range_min_m"),
    (lambda: scan(stamp_s=NAN), "stamp_s must be finite"),
    (lambda: scan(time_increment_s=-0.1), "time_increment_s"),
    (lambda: Scanner.mounted(0, 0, 0, field_of_view_rad=(1.0, -1.0)), "lowest and the highest"),
    (lambda: Scanner.mounted(0, 0, 0, body_base_m=np.zeros((2, 2))), "3 or more corners"),
    (lambda: RobotMotion.between(1.0, np.eye(4), 1.0, np.eye(4)), "later than start_s"),
    (lambda: candidate(kind="ghost"), "kind must be one of two_legs"),
    (lambda: candidate(score=1.5), "score"),
    (lambda: LegDetectorConfig(score_threshold=2.0), "score_threshold"),
    (lambda: LegDetector(static_map=np.zeros((3, 3))), "must be a StaticMap, got ndarray"),
    (lambda: observations_of([(1.0, 2.0)], np.eye(4)), r"candidates\[0\] must be a Person"),
    (lambda: observations_of([], 2.0 * np.eye(4)), "T_odom_scanner"),
    (lambda: StaticMap(np.zeros(3), (0.0, 0.0), 0.1), r"shape \(H, W\)"),
    (lambda: StaticMap(np.zeros((3, 3)), (0.0, 0.0), 0.0), "resolution_m"),
    (lambda: StaticMap(np.zeros((3, 3)), (0.0, 0.0), 0.1, -1.0), "margin_m"),
]


@pytest.mark.parametrize(("make", "message"), TYPES + STAGES + NETWORKS + LASER)
def test_it_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(PerceptionError, match=message):
        make()


def test_the_observation_of_the_truth_is_the_one_that_is_checked() -> None:
    truth = (0.5, np.array([0.1, 0.2, 3.0]), 0.01 * np.eye(3), np.array([0.0, 0.6, -0.8]), 0.7, 0.1)
    checked, true = PersonObservation(*truth, score=1.0), PersonObservation.true(*truth)
    for field in fields(PersonObservation):
        np.testing.assert_array_equal(getattr(true, field.name), getattr(checked, field.name))
