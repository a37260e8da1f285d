"""Irises of the workers: of human size, on the eyeballs only, and turning with the eyes."""

from __future__ import annotations

import math
from importlib import resources

import cv2
import numpy as np
import pytest
from worker_looks import LOOKS

from perception import Camera
from sim_tests import CameraRenderer, Warehouse, Worker
from sim_tests.actors.body import JOINTS, load_worker

FOLDER = resources.files("sim_tests.actors.body") / "workers"


def shipped_texture(name, level):
    data = np.frombuffer((FOLDER / f"{name}_lod{level}.jpg").read_bytes(), np.uint8)
    return cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1]


@pytest.mark.parametrize("name", LOOKS)
def test_only_eyeballs_are_painted_and_only_for_near_people(name):
    asset = load_worker(name)
    for level in (1, 2):
        assert np.array_equal(asset.levels[level].texture_rgb, shipped_texture(name, level))
    finest = asset.levels[0]
    changed = (finest.texture_rgb != shipped_texture(name, 0)).any(axis=2)
    assert changed.any()
    eyes = [row for row, joint in enumerate(JOINTS) if joint.endswith("_eye")]
    is_eye = (finest.weights[:, eyes] > 0.5).any(axis=1)
    height, width = changed.shape
    others = np.zeros_like(changed, dtype=np.uint8)
    for triangle in finest.triangles[~is_eye[finest.triangles].all(axis=1)]:
        corners = np.column_stack(
            [finest.uv[triangle, 0] * width, (1.0 - finest.uv[triangle, 1]) * height]
        )
        cv2.fillConvexPoly(others, np.floor(corners).astype(np.int32), 1)
    assert np.count_nonzero(changed & (others > 0)) == 0


def pupil_m(view, camera, eye_camera_m):
    """Return how far right of an eye's keypoint the darkest part of a narrow strip lies."""
    u, v = camera.project(eye_camera_m[None])[0]
    scale = eye_camera_m[2] / camera.fx_px
    half = int(0.009 / scale)
    strip = view.rgb[int(v) - 3 : int(v) + 4, int(u) - half : int(u) + half + 1]
    grey = strip.astype(float).mean(axis=(0, 2))
    dark = np.flatnonzero(grey < grey.min() + 0.08 * (grey.max() - grey.min()))
    return scale * (dark.mean() - half)


def test_the_pupil_moves_with_the_eye():
    camera = Camera.from_fov(640, 480, math.radians(6.0))
    turns = np.radians([-8.0, 0.0, 8.0])
    with Warehouse() as warehouse:
        worker = Worker(warehouse, look="giulia")
        renderer = CameraRenderer(warehouse)
        worker.place((2.0, 0.0), math.pi)
        eye = worker.keypoints_odom_m[1]  # moves with the eye
        T_odom_camera = np.array(
            [[0, 0, 1, 0], [-1, 0, 0, eye[1]], [0, -1, 0, eye[2]], [0, 0, 0, 1]], dtype=float
        )
        eye_camera = (eye - T_odom_camera[:3, 3]) @ T_odom_camera[:3, :3]
        places = []
        for turn in turns:
            worker.place((2.0, 0.0), math.pi, eye_yaw_rad=float(turn))
            places.append(pupil_m(renderer.render(camera, T_odom_camera), camera, eye_camera))
    # The person's left is the image's right; the eyeball has a radius of 16 mm.
    assert np.diff(places) == pytest.approx(np.diff(0.016 * np.sin(turns)), abs=8e-4)
