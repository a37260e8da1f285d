"""The bodies of workers.

The shipped assets (meshes, joints, keypoints), their skeletons, the gait and its footsteps, the
postures of the arms, sitting and kneeling, and :class:`Worker`, which places a body in the physics
and the render world.
"""

from __future__ import annotations

from ._asset import (
    DETAIL_LEVELS,
    JOINTS,
    MESH_UNITS,
    PARENTS,
    WorkerAsset,
    load_worker,
    worker_file,
    worker_names,
)
from ._footsteps import OnlineFootsteps
from ._gait import Gait, GaitPose
from ._pose import BodyPose, link_transforms, skin_points
from ._postures import (
    ACTIVITIES,
    BOX_SIZE_M,
    KNEELING_EYE_HEIGHT_SHARE,
    PHONE_SIZE_M,
    SEATED_EYE_HEIGHT_SHARE,
    STAYING,
    Activity,
    ActivityName,
)
from ._skeleton import MAX_STATURE_M, MIN_STATURE_M, skeleton
from ._skin import SeatKind, WorkerSkin
from ._worker import (
    MAX_EYE_PITCH_RAD,
    MAX_EYE_YAW_RAD,
    MAX_HEAD_PITCH_RAD,
    MAX_HEAD_YAW_RAD,
    Worker,
)
