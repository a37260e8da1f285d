"""The robot: its physics, its dimensions and limits, and its visual meshes."""

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
from ._look import AmrLook
from ._meshes import amr_meshes

__all__ = [
    "CAMERA_FORWARD_M",
    "CAMERA_HEIGHT_M",
    "MAX_YAW_RATE_RADPS",
    "NOVA_CARTER",
    "TRACK_M",
    "WHEEL_RADIUS_M",
    "Amr",
    "AmrLook",
    "amr_meshes",
]
