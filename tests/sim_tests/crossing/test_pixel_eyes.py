"""Rendered images through the whole pipeline, alone and in the closed loop."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from paths import SHARED

from perception import (
    AttentionCone,
    AwarenessPipeline,
    Camera,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
)
from perception.networks import OnnxPersonDetector
from sim_tests import KeypointNoise, Scenario, run_crossing
from sim_tests.crossing import Stage, TrueView
from sim_tests.crossing.eyes import (
    NOBODY,
    PIXEL_RATE_HZ,
    KeypointCamera,
    PixelEyes,
    match_to_workers,
    pixel_timing,
)
from sim_tests.world.camera import CameraTiming, SensorConfig
from sim_tests.world.sightlines import SightLines

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))
MODELS = SHARED / "models"
RTMDET = MODELS / "rtmdet_nano_person_320_mmpose.onnx"

TWO = """
name: two_workers
description: One worker ahead on the left looks at the robot, one on the right looks away.
duration_s: 1.0
control_hz: 20.0
layout: open
robot: {goal_x_m: 6.0}
camera: {width_px: 640, height_px: 480, horizontal_fov_deg: 60.0}
workers:
  - path: [{t_s: 0.0, x_m: 4.0, y_m: 0.8}]
    gaze: [{t_s: 0.0, look: robot}]
    heading: [{t_s: 0.0, heading_deg: 180.0}]
  - path: [{t_s: 0.0, x_m: 4.5, y_m: -1.0}]
    heading: [{t_s: 0.0, heading_deg: 0.0}]
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("scenario") / "two.yaml"
    path.write_text(TWO)
    return Scenario.from_yaml(path)


@pytest.fixture
def stage(scenario: Scenario) -> Iterator[Stage]:
    with Stage(scenario, np.zeros(2)) as stage:
        yield stage


class Blind:
    """A pose estimator without keypoints: people are located by their boxes, without awareness."""

    def estimate(
        self, image_rgb: np.ndarray, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        nothing = PersonKeypoints(np.zeros((17, 2)), np.zeros((17, 3)), np.zeros(17), "coco")
        return (nothing,) * len(detections)


def observation(x_m: float, z_m: float, box: tuple[float, ...] | None) -> PersonObservation:
    return PersonObservation(
        0.0, [x_m, 0.0, z_m], 0.01 * np.eye(3), None, None, None, 0.9,
        None if box is None else np.array(box),
    )  # fmt: skip


def view(x_m: float, z_m: float) -> TrueView:
    return TrueView(
        np.array([x_m, 0.0, z_m]), np.array([0.0, 0.0, -1.0]), 0.5, np.zeros(2), np.zeros(2)
    )


def test_observations_are_matched_to_the_workers_they_show():
    truth = (view(-1.0, 3.0), view(1.0, 4.0), view(0.0, 9.0))
    boxes = [np.array([50.0, 50, 150, 350]), np.array([400.0, 80, 480, 320]), None]
    seen = (
        observation(1.1, 4.2, (402, 84, 478, 322)),  # by box and position
        observation(-1.0, 4.5, (52, 50, 150, 340)),  # by box alone
        observation(0.1, 8.9, (300, 100, 330, 200)),  # at an invisible worker
        observation(3.0, 3.0, (600, 100, 640, 200)),  # a ghost
    )
    assert match_to_workers(seen, truth, boxes) == (1, 0, NOBODY, NOBODY)
    assert match_to_workers(seen[:2], (), []) == (NOBODY, NOBODY)
    assert match_to_workers((), truth, boxes) == ()


def test_rendered_people_are_observed_at_their_true_positions(stage: Stage):
    cone = AttentionCone()
    lines = SightLines(stage.warehouse.layout, actors=stage.warehouse.actors)
    keypoints = KeypointCamera(CAMERA, lines, KeypointNoise(), np.random.default_rng(0))
    pipeline = AwarenessPipeline(CAMERA, keypoints, keypoints, cone=cone)
    eyes = PixelEyes(stage, CAMERA, SensorConfig(), np.random.default_rng(0), pipeline)
    T_odom_camera = stage.amr.T_odom_camera
    truth = stage.truth(cone, T_odom_camera)
    keypoints.look(T_odom_camera, stage.workers)
    seen = eyes.observe(0.25, T_odom_camera, truth)
    assert sorted(worker for _, worker in seen) == [0, 1]
    for each, worker in seen:
        assert each.stamp_s == 0.25
        true = truth[worker].position_camera_m
        assert np.linalg.norm(each.position_camera_m - true) < 0.05 * np.linalg.norm(true)
    alpha = {worker: each.awareness or 0.0 for each, worker in seen}
    assert alpha[0] > 0.6
    assert alpha[1] < 0.1


def test_a_rendered_camera_without_a_rate_takes_ten_images_a_second():
    assert pixel_timing(CameraTiming()).rate_hz == PIXEL_RATE_HZ
    assert pixel_timing(CameraTiming(rate_hz=4.0, drop_rate=0.1)) == CameraTiming(
        rate_hz=4.0, drop_rate=0.1
    )


@pytest.mark.skipif(not RTMDET.is_file(), reason=f"needs {RTMDET.name} in the folder of models")
def test_a_crossing_runs_with_a_real_detector_on_rendered_images(scenario: Scenario):
    detector = OnnxPersonDetector(RTMDET)
    results = []
    for _ in range(2):
        pipeline = AwarenessPipeline(CAMERA, detector, Blind())
        results.append(
            run_crossing(scenario, policy="balanced", perception="pixels", pipeline=pipeline)
        )
    result = results[0]
    assert result.perception == "pixels"
    stamps = [frame.t_s for frame in result.frames if frame.observations]
    assert np.diff(stamps) == pytest.approx(1.0 / PIXEL_RATE_HZ, abs=0.051)
    assert len(stamps) >= 8
    workers = set()
    for frame in result.frames:
        for found, worker in zip(frame.observations, frame.observed_workers, strict=True):
            # A box alone is no evidence of awareness.
            assert found.awareness is None
            left, _, right, _ = found.box_xyxy_px
            # A person cut off by the border of the image has no height that gives the range.
            cut_off = left < 1.0 or right > CAMERA.width_px - 1.0
            if worker != NOBODY and not cut_off:
                workers.add(worker)
                true = frame.truth[worker].position_camera_m
                assert np.linalg.norm(found.position_camera_m - true) < 0.3 * np.linalg.norm(true)
        assert all(track.awareness_lower < 0.1 for track in frame.tracks)
    assert workers == {0, 1}
    first, second = ([frame.command for frame in each.frames] for each in results)
    assert first == second


def test_a_worker_is_matched_to_one_observation_only():
    truth, boxes = (view(0.0, 3.0),), [np.array([100.0, 100, 200, 400])]
    twice = (
        observation(0.3, 3.0, (110, 100, 220, 400)),
        observation(0.0, 3.0, (100, 100, 200, 400)),
    )
    assert match_to_workers(twice, truth, boxes) == (NOBODY, 0)
