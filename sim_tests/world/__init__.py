"""The simulated hall: its physics, its pictures, and lines of sight in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._sight import (
        FACE_DEPTH_M,
        FACE_KEYPOINTS,
        JOINT_DEPTH_M,
        crosses_boxes,
        keypoints_in_front,
        sees,
    )
    from ._warehouse import PERSON_GROUP, RAY_GROUP, ROBOT_GROUP, Warehouse

__all__ = [
    "FACE_DEPTH_M",
    "FACE_KEYPOINTS",
    "JOINT_DEPTH_M",
    "PERSON_GROUP",
    "RAY_GROUP",
    "ROBOT_GROUP",
    "Warehouse",
    "crosses_boxes",
    "keypoints_in_front",
    "sees",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._sight": (
            "FACE_DEPTH_M",
            "FACE_KEYPOINTS",
            "JOINT_DEPTH_M",
            "crosses_boxes",
            "keypoints_in_front",
            "sees",
        ),
        "._warehouse": (
            "PERSON_GROUP",
            "RAY_GROUP",
            "ROBOT_GROUP",
            "Warehouse",
        ),
    },
)
