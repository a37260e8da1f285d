"""Irises of the workers: of human size, on the eyeballs only, and turning with the eyes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from perception import Camera
from sim_tests import CameraRenderer, Warehouse, Worker


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
