"""Refusals of hall, light, cameras and renderers, by the name of what was given."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from perception import Camera
from sim_tests import Scenario, SimError
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer, CoarseSceneryRenderer, SensorConfig, expose
from sim_tests.world.hall import Lighting, Prop, RackBox, WarehouseLayout
from sim_tests.world.render import RenderView
from sim_tests.world.scanner import ScannerSpec

CAMERA = Camera(320, 240, 270.0, 260.0, 171.3, 110.6)
DISTORTED = Camera(32, 24, 30, 30, 16, 12, np.array([0.1, 0, 0, 0, 0]))


def hall_of(**fields: Any) -> WarehouseLayout:
    sides = {"x_min_m": 0.0, "y_min_m": 0.0, "x_max_m": 5.0, "y_max_m": 5.0}
    return WarehouseLayout(**{**sides, **fields})


def camera_of(**fields: Any) -> Any:
    return Scenario.shipped("crossing_attentive").camera.model_validate(fields)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Lighting(ambient=0.8, diffuse=0.4), "wash out"),
        (lambda: Lighting(direction_odom=(0.0, 0.0, 0.0)), "direction_odom must point towards"),
        (lambda: Lighting(ambiant=0.5), "did you mean 'ambient'"),
        (lambda: Lighting.preset("warm_sodum"), "did you mean 'warm_sodium'"),
        (lambda: SensorConfig(shot_nois=True), "did you mean 'shot_noise'"),
        (lambda: SensorConfig(full_well_e=0.0), "full_well_e"),
        (lambda: expose(np.zeros((2, 2, 3)), SensorConfig(), np.random.default_rng(0)), "uint8"),
        (lambda: Warehouse(renderer="tinny"), "did you mean 'tiny'"),
        (
            lambda: hall_of(racks=(RackBox(x_m=5.0, y_m=2.0, length_m=2.0, width_m=1.0),)),
            r"the rack at \(5, 2\) m reaches outside the hall",
        ),
        (lambda: hall_of(props=(Prop(kind="bin", x_m=4.9, y_m=2.0),)), r"the bin at \(4\.9, 2\)"),
        (lambda: hall_of(x_max_m=-1.0), "x_min_m < x_max_m"),
        (lambda: hall_of(x_min_m=math.nan), "x_min_m"),
        (lambda: hall_of(rack=()), "did you mean 'racks'"),
        (lambda: WarehouseLayout.named("crosing"), "did you mean 'crossing'"),
        (lambda: Prop(kind="forklif", x_m=0.0, y_m=0.0), "did you mean 'forklift'"),
        (lambda: Prop(kind="bin", x_m=0.0, y_m=0.0, yaw_deg=400.0), "yaw_deg"),
        (lambda: ScannerSpec(field_of_view_deg=(90.0, -90.0)), "lowest and the highest"),
        (lambda: ScannerSpec(field_of_view_deg=(-200.0, 200.0)), "at most 360"),
        (lambda: ScannerSpec(range_min_m=9.0, range_max_m=5.0), "must exceed range_min_m"),
        (
            lambda: camera_of(width_px=640, height_px=480, scenery_divisor=7),
            "scenery_divisor must divide",
        ),
    ],
)
def test_unusable_settings_are_refused(make, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"roi_xyxy_px": (10, 10, 10, 20)}, "roi_xyxy_px"),
        ({"roi_xyxy_px": (0, 0, math.nan, 20)}, "roi_xyxy_px"),
        ({"size_px": (0, 10)}, "size_px"),
        ({"T_odom_camera": np.ones((4, 4))}, "T_odom_camera"),
        ({"camera": DISTORTED}, "undistorted"),
    ],
)
def test_unusable_images_are_refused(hall: Warehouse, given: dict, message: str) -> None:
    good = {"camera": CAMERA, "T_odom_camera": np.eye(4)}
    with pytest.raises(SimError, match=message):
        CameraRenderer(hall).render(**{**good, **given})
    with pytest.raises(SimError, match="blocks of 7 pixels must fill the image, got 320 x 240"):
        CoarseSceneryRenderer(hall, 7).render(CAMERA, np.eye(4))


def test_a_closed_warehouse_neither_steps_nor_is_rendered() -> None:
    warehouse = Warehouse()
    visuals = warehouse.visuals
    warehouse.close()
    warehouse.close()
    with pytest.raises(SimError, match="closed"):
        warehouse.step()
    with pytest.raises(SimError, match="closed"):
        visuals.prepare(RenderView.of_rectangle(CAMERA, np.eye(4)))
