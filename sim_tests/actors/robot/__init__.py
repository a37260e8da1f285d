"""Robots: their physics, dimensions and limits, and their visual meshes."""

from __future__ import annotations

from ._amr import (
    CAMERA_FORWARD_M,
    CAMERA_HEIGHT_M,
    MAX_YAW_RATE_RADPS,
    NOVA_CARTER,
    TRACK_M,
    WHEEL_RADIUS_M,
    Amr,
)
from ._kinematic_robot import KinematicRobot
from ._look import AmrLook, KinematicLook, amr_meshes, model_meshes
from ._model import BodyPart, RobotModel, shipped_robots

__all__ = [
    "CAMERA_FORWARD_M",
    "CAMERA_HEIGHT_M",
    "MAX_YAW_RATE_RADPS",
    "NOVA_CARTER",
    "TRACK_M",
    "WHEEL_RADIUS_M",
    "Amr",
    "AmrLook",
    "BodyPart",
    "KinematicLook",
    "KinematicRobot",
    "RobotModel",
    "amr_meshes",
    "model_meshes",
    "shipped_robots",
]
