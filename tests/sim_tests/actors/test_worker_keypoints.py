"""A worker is drawn where its skin is, and its keypoints lie on what is drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from perception import Camera
from sim_tests.actors.body import Worker, skin_points
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import WarehouseLayout

# Upright, so that a whole body fills it: a pixel is 4 mm wide at the body.
CAMERA = Camera.from_fov(480, 640, math.radians(30.0))
# Looking along odom x from a height of 1 m.
T_ODOM_CAMERA = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.0], [0, 0, 0, 1.0]])
DISTANCE_M = 3.4
POSES = (
    {},
    {"head_yaw_rad": 1.2, "head_pitch_rad": -0.5},
    {"head_yaw_rad": -0.9, "head_pitch_rad": 0.4, "speed_mps": 1.4, "walked_m": 0.5},
    {"activity": "phone", "head_pitch_rad": -0.6},
)


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.named("open"), renderer="auto") as warehouse:
        yield warehouse


def projected(points_odom_m: np.ndarray) -> np.ndarray:
    return CAMERA.project((points_odom_m - T_ODOM_CAMERA[:3, 3]) @ T_ODOM_CAMERA[:3, :3])


@pytest.mark.parametrize("pose", POSES)
def test_a_worker_is_drawn_where_its_skin_is(hall: Warehouse, pose: dict) -> None:
    worker = Worker(hall, look="amina")
    skin, renderer = worker.asset.levels[0], CameraRenderer(hall)
    for heading in np.linspace(0.0, math.tau, 4, endpoint=False):
        worker.place((DISTANCE_M, 0.0), heading, **pose)
        view = renderer.render(CAMERA, T_ODOM_CAMERA, only={worker.actor})
        drawn = view.actors == worker.actor
        points = skin_points(worker.asset.joints_m, worker.pose, skin.vertices_m, skin.weights)
        pixels = projected(points)
        # Every vertex lies on a drawn pixel or beside one, and so do the edges of the picture.
        beside = cv2.dilate(drawn.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
        columns, rows = np.rint(pixels).astype(int).T
        assert beside[rows, columns].all()
        if worker.held is None:
            rows, columns = np.nonzero(drawn)
            box = [columns.min(), rows.min(), columns.max(), rows.max()]
            skin_box = np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])
            np.testing.assert_allclose(box, skin_box, atol=1.5)
        columns, rows = np.rint(projected(worker.keypoints_odom_m[:17])).astype(int).T
        assert drawn[rows, columns].all()
