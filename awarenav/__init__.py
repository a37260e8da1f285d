"""Awareness-aware navigation: a robot moves differently around people who have seen it.

The main names of :mod:`perception`, :mod:`tracking` and :mod:`nav_adapter`, imported on first use:
``awarenav.AwarenessPipeline``, ``awarenav.PersonTracker``, ``awarenav.NavAdapter`` and the types
between them. The command line is :mod:`awarenav.cli`; closed-loop crossings are :mod:`sim_tests`.
"""

from __future__ import annotations

from pathlib import Path
from runpy import run_path

# Run by its path: an import by name could run a foreign package called perception.
_CLASH = Path(__file__).parents[1] / "perception" / "_clash.py"
run_path(str(_CLASH))["require_sole_owner"](__name__)

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from nav_adapter import (
        AwarenessPolicy,
        InflationPolicy,
        NavAdapter,
        NavConstraints,
        NavError,
        PersonObstacle,
        RobotProfile,
        RobotState,
        SpeedPolicy,
        boxes,
        circles,
        paint_costmap,
        points,
        polygons,
    )
    from nav_adapter.ros2 import Navigator
    from perception import (
        AttentionCone,
        AwarenessPipeline,
        Camera,
        HeadPose,
        HeadPoseEstimator,
        OnnxHeadPoseEstimator,
        OnnxPersonDetector,
        OnnxPoseEstimator,
        PerceptionError,
        PersonDetection,
        PersonDetector,
        PersonKeypoints,
        PersonObservation,
        PnpHeadPoseEstimator,
        PoseEstimator,
    )
    from perception.errors import AwarenavError
    from tracking import PersonTrack, PersonTracker, TrackerConfig, TrackingError

__version__ = "0.4.0"

__all__ = [
    "AttentionCone",
    "AwarenavError",
    "AwarenessPipeline",
    "AwarenessPolicy",
    "Camera",
    "HeadPose",
    "HeadPoseEstimator",
    "InflationPolicy",
    "NavAdapter",
    "NavConstraints",
    "NavError",
    "Navigator",
    "OnnxHeadPoseEstimator",
    "OnnxPersonDetector",
    "OnnxPoseEstimator",
    "PerceptionError",
    "PersonDetection",
    "PersonDetector",
    "PersonKeypoints",
    "PersonObservation",
    "PersonObstacle",
    "PersonTrack",
    "PersonTracker",
    "PnpHeadPoseEstimator",
    "PoseEstimator",
    "RobotProfile",
    "RobotState",
    "SpeedPolicy",
    "TrackerConfig",
    "TrackingError",
    "boxes",
    "circles",
    "paint_costmap",
    "points",
    "polygons",
]

__getattr__ = lazy_page(__name__, __file__)
