"""Projected true keypoints fall on the rendered body, where coloured markers are found."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache

import cv2
import numpy as np
import pytest
from worker_looks import LOOKS

from perception import Camera
from sim_tests.actors.body import (
    JOINTS,
    SkinMesh,
    Worker,
    WorkerSkin,
    load_worker,
    skin_points,
    worker_names,
)
from sim_tests.world import Warehouse
from sim_tests.world.camera import CameraRenderer
from sim_tests.world.hall import Lighting, WarehouseLayout

# The part of an image of 640 × 480 px and 60° that holds the head.
WHOLE = Camera.from_fov(640, 480, math.radians(60.0))
CAMERA = Camera(160, 200, WHOLE.fx_px, WHOLE.fy_px, WHOLE.cx_px - 240.0, WHOLE.cy_px - 90.0)
MARKERS = ((255, 0, 255), (0, 255, 255), (255, 255, 0), (0, 0, 255), (0, 255, 0))
MARKER_M = 0.009
DISTANCE_M = 3.0
LEAST_PIXELS = 4
# Every pixel has the colour of its texel, without shading.
FLAT = Lighting(ambient=1.0, diffuse=0.0, specular=0.0, shadows=False)
POSES = (
    {},
    {"head_yaw_rad": 1.2, "head_pitch_rad": -0.5},
    {"head_yaw_rad": -0.9, "head_pitch_rad": 0.4, "speed_mps": 1.4, "walked_m": 0.5},
    {"activity": "phone", "head_pitch_rad": -0.6},
    {"activity": "carry_box", "speed_mps": 1.0, "walked_m": 0.9},
)


@pytest.fixture(scope="module")
def hall() -> Iterator[Warehouse]:
    with Warehouse(WarehouseLayout.named("open"), renderer="auto") as warehouse:
        yield warehouse


def texel_points(skin: SkinMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return (H, W) the triangle of each texel or −1, and (H, W, 3) its place at rest."""
    height, width = skin.texture_rgb.shape[:2]
    corners = skin.uv[skin.triangles] * (width, height)
    corners[..., 1] = height - corners[..., 1]
    owner = np.full((height, width), -1, np.int32)
    for row, corner in enumerate(corners):
        cv2.fillConvexPoly(owner, np.floor(corner).astype(np.int32), row)
    rows, columns = np.nonzero(owner >= 0)
    triangle = owner[rows, columns]
    a, b, c = (corners[triangle, k] for k in range(3))
    at = np.stack([columns + 0.5, rows + 0.5], axis=-1)
    area = cross(b - a, c - a)
    area = np.where(np.abs(area) < 1e-9, 1e-9, area)
    second, third = cross(at - a, c - a) / area, cross(b - a, at - a) / area
    shares = np.clip(np.stack([1.0 - second - third, second, third], axis=-1), 0.0, 1.0)
    shares /= shares.sum(axis=1, keepdims=True)
    points = np.full((height, width, 3), np.inf)
    points[rows, columns] = np.einsum(
        "nk,nkc->nc", shares, skin.vertices_m[skin.triangles[triangle]]
    )
    return owner, points


def cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return (N,) the cross products of (N, 2) vectors."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


@cache
def marked(look: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the finest texture with a marker at each face keypoint, and their places at rest."""
    asset = load_worker(look)
    skin = asset.levels[0]
    owner, points = texel_points(skin)
    head = skin.weights[skin.triangles][..., JOINTS.index("neck")].min(axis=1) > 0.99
    texture = np.full_like(skin.texture_rgb, 90)
    places = np.empty((5, 3))
    rows, columns = np.nonzero((owner >= 0) & head[np.maximum(owner, 0)])
    texels = points[rows, columns]
    for row, (keypoint, colour) in enumerate(zip(asset.keypoints_m[:5], MARKERS, strict=True)):
        # A keypoint below the skin is replaced by the nearest point of the skin.
        places[row] = texels[np.argmin(np.linalg.norm(texels - keypoint, axis=-1))]
        near = np.linalg.norm(texels - places[row], axis=-1) < MARKER_M
        texture[rows[near], columns[near]] = colour
    return texture, places


def pixel_errors(hall: Warehouse, look: str, headings: int = 8) -> list[float]:
    """Return distances (px) between found markers and projected keypoints, over many poses."""
    texture, places = marked(look)
    head = np.zeros((5, len(JOINTS)))
    head[:, [JOINTS.index("spine"), JOINTS.index("neck")]] = 1.0
    errors = []
    worker = Worker(hall, load_worker(look).stature_m, look=look)
    actor = hall.visuals.add_actor(WorkerSkin(worker, [texture] * 3))
    renderer = CameraRenderer(hall, lighting=FLAT)
    T_odom_camera = np.eye(4)
    T_odom_camera[:3, :3] = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    T_odom_camera[2, 3] = 1.4
    for pose in POSES:
        for heading in np.linspace(0.0, 2.0 * math.pi, headings, endpoint=False):
            worker.place((DISTANCE_M, 0.0), heading, **pose)
            view = renderer.render(CAMERA, T_odom_camera, only={actor})
            where = skin_points(worker.asset.joints_m, worker.pose, places, head)
            pixels = CAMERA.project((where - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3])
            for colour, pixel in zip(MARKERS, pixels, strict=True):
                rows, columns = np.nonzero((view.rgb == colour).all(axis=-1))
                if len(rows) >= LEAST_PIXELS:
                    found = np.array([columns.mean(), rows.mean()])
                    errors.append(float(np.linalg.norm(found - pixel)))
    return errors


@pytest.mark.parametrize("look", ["amina"])
def test_markers_are_found_where_keypoints_are_projected(hall: Warehouse, look: str) -> None:
    errors = pixel_errors(hall, look, headings=4)
    assert len(errors) >= 15  # long hair hides ears
    assert np.median(errors) <= 1.0
    assert np.percentile(errors, 95) <= 2.5


@pytest.mark.full
def test_over_all_workers_the_median_is_within_two_pixels(hall: Warehouse) -> None:
    errors = [error for look in worker_names() for error in pixel_errors(hall, look, headings=3)]
    assert np.median(errors) <= 2.0


@pytest.mark.parametrize("look", LOOKS)
def test_keypoints_of_the_face_lie_on_it(look: str) -> None:
    asset = load_worker(look)
    _, places = marked(look)
    gaps = np.linalg.norm(places - asset.keypoints_m[:5], axis=1)
    assert gaps.max() < 0.02
    eyes = asset.joints_m[[JOINTS.index("left_eye"), JOINTS.index("right_eye")]]
    pupils = eyes + np.array([0.012, 0.0, 0.0])
    assert np.linalg.norm(asset.keypoints_m[1:3] - pupils, axis=1).max() < 0.012
