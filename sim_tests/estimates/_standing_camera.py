"""The pose of a camera that stands still, at a known height or an unknown one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from perception.arrays import FloatArray, finite_number

from .._errors import SimError

# Optical axes (right, down, forward) in axes of the robot (forward, left, up).
_LEVEL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def standing_pose(height_m: Any = 0.0, pitch_down_deg: Any = 0.0) -> FloatArray:
    """T_odom_camera (4, 4) with odom on the floor under the camera, x along its horizontal view.

    Args:
        height_m: of the camera above the floor, 0 to 20 m.
        pitch_down_deg: how far it looks down from the horizontal, −90 to 90.

    Raises:
        SimError: for a value outside these.
    """
    height = finite_number("camera height (m)", height_m, SimError, minimum=0.0, maximum=20.0)
    pitch = math.radians(
        finite_number("camera pitch (deg)", pitch_down_deg, SimError, minimum=-90.0, maximum=90.0)
    )
    turn = np.array(
        [
            [math.cos(pitch), 0.0, math.sin(pitch)],
            [0.0, 1.0, 0.0],
            [-math.sin(pitch), 0.0, math.cos(pitch)],
        ]
    )
    pose = np.eye(4)
    pose[:3, :3] = turn @ _LEVEL
    pose[2, 3] = height
    return pose
