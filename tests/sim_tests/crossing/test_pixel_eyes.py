"""Rendered images through the whole pipeline, alone and in the closed loop."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from watching_cameras import setup_on

from perception import (
    AttentionCone,
    AwarenessPipeline,
    Camera,
    PersonDetection,
    PersonKeypoints,
    PersonObservation,
)
from sim_tests import KeypointNoise, Scenario, run_crossing
from sim_tests.crossing import Stage, TrueView
from sim_tests.crossing.sensors import (
    NOBODY,
    PIXEL_RATE_HZ,
    KeypointCamera,
    World,
    match_to_workers,
    sensor_class,
)
from sim_tests.world.camera import CameraTiming
from sim_tests.world.sightlines import SightLines

CAMERA = Camera.from_fov(640, 480, math.radians(60.0))

TWO = """
name: two_workers
description: One worker ahead on the left looks at the robot, one on the right looks away.
duration_s: 1.0
control_hz: 20.0
layout: open
robot: {goal_x_m: 6.0}
camera: {width_px: 640, height_px: 480, horizontal_fov_deg: 60.0}
people:
  - name: left
    route: [{x_m: 4.0, y_m: 0.8}]
    heading_deg: 180.0
    gaze: [{t_s: 0.0, look: robot}]
  - name: right
    route: [{x_m: 4.5, y_m: -1.0}]
    heading_deg: 0.0
    gaze: [{t_s: 0.0, look: ahead}]
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("scenario") / "two.yaml"
    path.write_text(TWO)
    return Scenario.from_yaml(path)


@pytest.fixture
def stage(scenario: Scenario) -> Iterator[Stage]:
    with Stage(scenario) as stage:
        yield stage


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
    camera = sensor_class("pixels")(setup_on(stage, pipeline=pipeline))
    T_odom_camera = stage.amr.T_odom_camera
    truth = stage.truth(cone, T_odom_camera)
    keypoints.look(T_odom_camera, stage.workers)
    now = World(0.25, T_odom_camera, T_odom_camera, truth, stage.amr.state(0.25))
    ((seen,),) = [[each.observations for each in camera.look(now)]]
    assert sorted(worker for _, worker in seen) == [0, 1]
    for each, worker in seen:
        assert each.stamp_s == 0.25
        true = truth[worker].position_camera_m
        assert np.linalg.norm(each.position_camera_m - true) < 0.05 * np.linalg.norm(true)
    alpha = {worker: each.awareness or 0.0 for each, worker in seen}
    assert alpha[0] > 0.6
    assert alpha[1] < 0.1


class Nobody:
    """Detector and pose estimator that find nobody; counts the images."""

    images = 0

    def detect(self, image_rgb: np.ndarray) -> tuple[PersonDetection, ...]:
        assert image_rgb.shape == (480, 640, 3)
        self.images += 1
        return ()

    def estimate(
        self, image_rgb: np.ndarray, detections: tuple[PersonDetection, ...]
    ) -> tuple[PersonKeypoints, ...]:
        assert not detections
        return ()


@pytest.mark.parametrize("rate_hz", [None, 4.0])
def test_a_pipeline_of_ones_own_has_ten_images_a_second_or_the_rate_of_the_scenario(
    scenario: Scenario, rate_hz: float | None
):
    nobody = Nobody()
    pipeline = AwarenessPipeline(CAMERA, nobody, nobody)
    timing = CameraTiming(rate_hz=rate_hz)
    scenario = scenario.model_copy(
        update={"camera": scenario.camera.model_copy(update={"timing": timing})}
    )
    result = run_crossing(scenario, policy="balanced", perception="pixels", pipeline=pipeline)
    assert result.perception == "pixels"
    assert nobody.images == pytest.approx((rate_hz or PIXEL_RATE_HZ) * scenario.duration_s, abs=1)
    assert not any(frame.tracks for frame in result.frames)


def test_a_worker_is_matched_to_one_observation_only():
    truth, boxes = (view(0.0, 3.0),), [np.array([100.0, 100, 200, 400])]
    twice = (
        observation(0.3, 3.0, (110, 100, 220, 400)),
        observation(0.0, 3.0, (100, 100, 200, 400)),
    )
    assert match_to_workers(twice, truth, boxes) == (NOBODY, 0)
