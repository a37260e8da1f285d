"""The simulated warehouse: its physics, its rendering, its cameras, and lines of sight in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._visibility import (
        FACE_DEPTH_M,
        FACE_KEYPOINTS,
        JOINT_DEPTH_M,
        first_body_before,
        keypoints_in_front,
        sees,
    )
    from ._warehouse import GRAVITY_MPS2, PERSON_GROUP, RAY_GROUP, ROBOT_GROUP, Nearest, Warehouse
    from .floor_plan import crosses_boxes

__getattr__ = lazy_page(__name__, __file__)
