"""A camera with a view in all directions: a rendered panorama, and crossings with it."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import pytest
from pydantic import ValidationError
from watching_cameras import setup_on

from perception import AttentionCone, AwarenessPipeline, Camera, FloorPlane
from perception.surround import PanoramaLens, SurroundPipeline, ring_of_views
from sim_tests import CameraRenderer, Scenario, SimError, run_crossing
from sim_tests.crossing import Stage
from sim_tests.crossing.sensors import World, sensor_class
from sim_tests.scenario import CameraSpec, shipped_scenarios
from sim_tests.study.runs import named_scenarios, plan_jobs

CONE = AttentionCone()
# Three workers around the robot: ahead at the left, at the border of two views; behind, across the
# seam of a panorama; and to the right, looking away.
THREE = """
name: three_around
description: Three workers stand around the robot.
duration_s: 1.0
control_hz: 20.0
layout: open
robot: {goal_x_m: 6.0}
people:
  - name: left
    route: [{x_m: 2.0, y_m: 2.0}]
    heading_deg: -135.0
    gaze: [{t_s: 0.0, look: robot}]
  - name: behind
    route: [{x_m: -2.6, y_m: 0.0}]
    heading_deg: 0.0
    gaze: [{t_s: 0.0, look: robot}]
  - name: right
    route: [{x_m: 0.0, y_m: -2.4}]
    heading_deg: -90.0
    gaze: [{t_s: 0.0, look: ahead}]
"""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("scenario") / "three.yaml"
    path.write_text(THREE)
    return Scenario.from_yaml(path).with_camera("surround")


def panorama(stage: Stage, T_odom_camera: np.ndarray, width_px: int) -> np.ndarray:
    """Return the image of a 360° camera, composed of the six faces of a cube."""
    size = width_px // 3
    face = Camera.from_fov(size, size, 0.5 * math.pi)
    renderer = CameraRenderer(stage.warehouse)
    heading = ((np.arange(width_px) + 0.5) / width_px - 0.5) * 2.0 * math.pi
    down = ((np.arange(width_px // 2) + 0.5) / (width_px // 2) - 0.5) * math.pi
    heading, down = np.meshgrid(heading, down)
    rays = np.stack(
        [np.sin(heading) * np.cos(down), np.sin(down), np.cos(heading) * np.cos(down)], axis=-1
    )
    image = np.zeros((*heading.shape, 3), np.uint8)
    turns = [
        view.rotation_camera_view for view in ring_of_views(face, np.radians([0, 90, 180, -90]))
    ]
    turns += [np.array([[1, 0, 0], [0, 0, side], [0, -side, 0]], float) for side in (1, -1)]
    for turn in turns:
        T = np.array(T_odom_camera)
        T[:3, :3] = T_odom_camera[:3, :3] @ turn
        inside = rays @ turn
        here = inside[..., 2] >= np.abs(inside).max(axis=-1) - 1e-9
        pixels = np.nan_to_num(face.project(inside.reshape(-1, 3)), nan=-1.0).astype(np.float32)
        u, v = (each.reshape(here.shape) for each in pixels.T)
        drawn = renderer.render(face, T).rgb
        flat = cv2.remap(drawn, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        image[here] = flat[here]
    return image


def test_the_shipped_networks_detect_all_people_in_a_panorama(scenario: Scenario) -> None:
    lens = PanoramaLens(1600, 800)
    flat = Camera.from_fov(728, 552, math.radians(110.0))
    views = ring_of_views(flat, np.radians([0, 90, 180, -90]))
    shipped = partial(AwarenessPipeline, simulator_networks=True)
    pipeline = SurroundPipeline(lens, views, shipped)
    with Stage(scenario) as stage:
        T_odom_camera = stage.amr.T_odom_camera
        truth = stage.truth(CONE, T_odom_camera)
        image = panorama(stage, T_odom_camera, lens.width_px)
        seen = pipeline.process(image, 0.0, FloorPlane.from_pose(T_odom_camera))
    assert len(seen) == 3
    for known, seam in zip(truth, (False, True, False), strict=True):
        nearest = min(
            seen, key=lambda each: np.linalg.norm(each.position_camera_m - known.position_camera_m)
        )
        assert np.linalg.norm(nearest.position_camera_m - known.position_camera_m) < 0.35
        assert (nearest.box_xyxy_px is None) == seam
        if not seam and nearest.box_xyxy_px is not None:
            left, top, right, bottom = nearest.box_xyxy_px
            u, v = lens.project([known.position_camera_m])[0]
            assert left < u < right
            assert top < v < bottom
        if known.awareness > 0.9:
            assert nearest.awareness is not None
            assert nearest.awareness > 0.6
        else:
            assert nearest.awareness is None or nearest.awareness < 0.2


def test_a_surround_camera_reports_each_person_once_and_nobody_else(scenario: Scenario) -> None:
    with Stage(scenario) as stage:
        camera = sensor_class("keypoints")(setup_on(stage))
        assert len(camera.views) == 4
        T_odom_camera = stage.amr.T_odom_camera
        truth = stage.truth(CONE, T_odom_camera)
        for step in range(50):
            now = World(0.1 * step, T_odom_camera, T_odom_camera, truth, stage.amr.state(0.0))
            (image,) = camera.look(now)
            seen = {worker: each for each, worker in image.observations}
            assert sorted(seen) == [0, 1, 2]
            for worker, observation in seen.items():
                away = observation.position_camera_m - truth[worker].position_camera_m
                spread = observation.position_covariance_m2 + 0.1**2 * np.eye(3)
                assert away @ np.linalg.solve(spread, away) < 25.0
            # The two who look at the robot are observed as aware, from any view.
            assert all((seen[worker].awareness or 0.0) > 0.7 for worker in (0, 1))


def test_the_camera_of_a_scenario_can_be_replaced(tmp_path: Path) -> None:
    for scenario in map(Scenario.shipped, shipped_scenarios()):
        if scenario.name != "paper_encounter":  # it has a camera of its own
            assert scenario.with_camera("forward") == scenario
        assert scenario.with_camera("") is scenario
        around = scenario.with_camera("surround")
        assert around.camera.views_deg == (0.0, 90.0, 180.0, -90.0)
        assert around.id == scenario.id
        assert around.distributions.keys() == scenario.distributions.keys()
    own = tmp_path / "own.yaml"
    own.write_text("{width_px: 640, height_px: 480, horizontal_fov_deg: 60.0}")
    scenario = Scenario.shipped("runs_out").with_camera(str(own))
    assert scenario.camera.width_px == 640
    assert Scenario.from_text(scenario.to_text()) == scenario
    with pytest.raises(
        SimError, match=r"'surround2' is unknown; did you mean 'surround'.*'forward', 'surround'"
    ):
        scenario.with_camera("surround2")
    own.write_text("{width: 640}")
    with pytest.raises(SimError, match="width_px"):
        scenario.with_camera(str(own))


def test_runs_and_searches_accept_a_camera() -> None:
    jobs = plan_jobs(["runs_out"], ["blind"], [0], camera="surround")
    assert Scenario.from_text(jobs[0].scenario_text).camera.mount == "top"
    (scenario,) = named_scenarios(["runs_out"], camera="surround")
    assert scenario.camera.mount == "top"


def test_impossible_views_are_refused() -> None:
    with pytest.raises(ValidationError, match=r"must begin with 0, straight ahead, got \[90"):
        CameraSpec(views_deg=(90.0, 0.0))
    with pytest.raises(ValidationError, match=r"must lie in \[-180, 180\]"):
        CameraSpec(views_deg=(0.0, 270.0))


@pytest.mark.slow
def test_a_person_behind_the_robot_is_still_observed_and_nobody_twice() -> None:
    """A worker behind the robot is outside the view of the forward camera, not of this one."""
    scenario = Scenario.shipped("standing_in_aisle").with_camera("surround")
    result = run_crossing(scenario.draw(0), policy="balanced", perception="keypoints")
    assert result.success
    behind = 0
    for frame in result.frames:
        assert len(set(frame.observed_workers)) == len(frame.observed_workers)
        behind += sum(each.position_camera_m[2] < 0.0 for each in frame.observations)
    assert behind > 20
