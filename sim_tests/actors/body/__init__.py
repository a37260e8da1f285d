"""Workers' bodies: meshes, skeleton, gait, postures, and the truth about their keypoints."""

from __future__ import annotations

from ._asset import load_worker, worker_names
from ._footing import Footing
from ._footsteps import footstep_table
from ._gait import Gait
from ._online_feet import OnlineFootsteps
from ._postures import Activity, ActivityName
from ._skeleton import MAX_STATURE_M, MIN_STATURE_M, skeleton
from ._worker import (
    MAX_EYE_PITCH_RAD,
    MAX_EYE_YAW_RAD,
    MAX_HEAD_PITCH_RAD,
    MAX_HEAD_YAW_RAD,
    Worker,
)

__all__ = [
    "MAX_EYE_PITCH_RAD",
    "MAX_EYE_YAW_RAD",
    "MAX_HEAD_PITCH_RAD",
    "MAX_HEAD_YAW_RAD",
    "MAX_STATURE_M",
    "MIN_STATURE_M",
    "Activity",
    "ActivityName",
    "Footing",
    "Gait",
    "OnlineFootsteps",
    "Worker",
    "footstep_table",
    "load_worker",
    "skeleton",
    "worker_names",
]
