"""Camera poses and rays for tests."""

from __future__ import annotations

import math

import numpy as np

from perception import Camera


def level_pose(
    position_m: tuple[float, float, float], heading_rad: float, pitch_down_rad: float = 0.0
) -> np.ndarray:
    """Return T_odom_camera of a camera with a level horizon."""
    ch, sh = math.cos(heading_rad), math.sin(heading_rad)
    cp, sp = math.cos(pitch_down_rad), math.sin(pitch_down_rad)
    forward = np.array([cp * ch, cp * sh, -sp])
    right = np.array([sh, -ch, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = position_m
    return pose


def pixel_rays(camera: Camera) -> np.ndarray:
    """Return the ray (H, W, 3) of each pixel in the optical frame, with z = 1."""
    rows, columns = np.mgrid[: camera.height_px, : camera.width_px]
    right, down = (columns - camera.cx_px) / camera.fx_px, (rows - camera.cy_px) / camera.fy_px
    return np.stack([right, down, np.ones(rows.shape)], axis=-1)
