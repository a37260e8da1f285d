"""Pose networks: keypoints of detected people in the image and in metres.

Besides the estimators, this page holds the steps around any SimCC network: the crops that it sees,
the reading of its outputs, and the lifting of keypoints to a skeleton in metres.
"""

from __future__ import annotations

from ._blazepose import BlazePoseEstimator
from ._crops import PersonCrops
from ._estimator import OnnxPoseEstimator
from ._lift import lift_keypoints, metres_per_pixel
from ._simcc import simcc_peaks

__all__ = [
    "BlazePoseEstimator",
    "OnnxPoseEstimator",
    "PersonCrops",
    "lift_keypoints",
    "metres_per_pixel",
    "simcc_peaks",
]
