"""Robots: their physics, dimensions and limits, and their visual meshes."""

from __future__ import annotations

from ._look import RobotLook, amr_meshes
from ._model import (
    CAMERA_FORWARD_M,
    CAMERA_HEIGHT_M,
    NOVA_CARTER,
    TRACK_M,
    WHEEL_RADIUS_M,
    BodyPart,
    RobotModel,
    shipped_robots,
)
from ._robots import Amr, KinematicRobot, Robot, robot_of
