"""One closed-loop crossing: camera, pipeline, tracker, adapter, planner and physics in a loop."""

from __future__ import annotations

from ._crossing import (
    Crossing,
    Observer,
    Situation,
    run_crossing,
)
from ._drawing import TopView, draw_camera_view
from ._metrics import CLEARANCE_M, STANDING_SPEED_MPS, ContactEvent, SafetyMeter
from ._policies import named_policy
from ._requests import RequestMemory
from ._result import CrossingFrame, CrossingResult
from ._stage import Stage, TrueView
from .planner import StraightOn

__all__ = [
    "CLEARANCE_M",
    "STANDING_SPEED_MPS",
    "ContactEvent",
    "Crossing",
    "CrossingFrame",
    "CrossingResult",
    "Observer",
    "RequestMemory",
    "SafetyMeter",
    "Situation",
    "Stage",
    "StraightOn",
    "TopView",
    "TrueView",
    "draw_camera_view",
    "named_policy",
    "run_crossing",
]
