"""Who is where, and have they noticed the robot: from an RGB frame to person observations."""

from __future__ import annotations

from ._detection import PersonDetection
from ._errors import PerceptionError
from ._head_pose import HeadPose
from ._keypoints import PersonKeypoints
from ._observation import PersonObservation

__all__ = [
    "HeadPose",
    "PerceptionError",
    "PersonDetection",
    "PersonKeypoints",
    "PersonObservation",
]
