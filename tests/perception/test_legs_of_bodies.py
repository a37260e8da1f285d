"""The place of the legs that the pipeline reports, from simulated keypoints of whole bodies."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import AwarenessPipeline, Camera
from sim_tests.actors.body import Worker
from sim_tests.crossing.eyes import KeypointCamera, KeypointNoise
from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.sightlines import SightLines

T_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
)
QUIET = KeypointNoise(pixel_std_px=0.3, lift_std_m=0.0, miss_rate=0.0)


@pytest.mark.parametrize("fov_deg", [120.0, 60.0])
@pytest.mark.parametrize("activity", ["none", "sitting"])
@pytest.mark.parametrize("stature_m", [1.75, 1.1])
def test_legs_are_ahead_of_the_trunk_of_people_who_sit(
    activity: str, stature_m: float, fov_deg: float
) -> None:
    layout = WarehouseLayout.named("open")
    with Warehouse(layout) as warehouse:
        worker = Worker(warehouse, stature_m, look="linnea")
        heading = 2.4
        worker.place((2.2, 0.2), heading, activity=activity)
        camera = Camera.from_fov(1280, 800, math.radians(fov_deg))
        sight = SightLines(layout, warehouse.variant, warehouse.actors)
        eye = KeypointCamera(camera, sight, QUIET, np.random.default_rng(0))
        eye.look(T_CAMERA, [worker])
        pipeline = AwarenessPipeline(camera, eye, eye)
        image = np.zeros((camera.height_px, camera.width_px, 3), np.uint8)
        (person,) = pipeline.process(image, 0.0)
    assert person.legs_camera_m is not None
    offset = T_CAMERA[:3, :3] @ (person.legs_camera_m - person.position_camera_m)
    ahead = math.cos(heading) * offset[0] + math.sin(heading) * offset[1]
    beside = math.cos(heading) * offset[1] - math.sin(heading) * offset[0]
    # The skeleton has the size of an average adult.
    expected = 0.41 if activity == "sitting" else 0.0
    assert ahead == pytest.approx(expected, abs=0.1)
    assert abs(beside) < 0.08
    assert offset[2] < -0.2
