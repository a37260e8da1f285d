"""One closed-loop crossing: camera, pipeline, tracker, adapter, planner and physics in a loop."""

from __future__ import annotations

from ._assembly import Setup, axis_names, changed, named_fault, named_policy
from ._crossing import Crossing, Observer, drive, run_crossing
from ._drawing import RequestMemory, TopView, draw_camera_view
from ._result import CrossingFrame, CrossingResult
from ._separations import (
    STANDING_SPEED_MPS,
    ContactEvent,
    SafetyFigures,
    contact_by,
)
from ._stage import Stage, TrueView
from .planner import StraightOn

__all__ = [
    "STANDING_SPEED_MPS",
    "ContactEvent",
    "Crossing",
    "CrossingFrame",
    "CrossingResult",
    "Observer",
    "RequestMemory",
    "SafetyFigures",
    "Setup",
    "Stage",
    "StraightOn",
    "TopView",
    "TrueView",
    "axis_names",
    "changed",
    "contact_by",
    "draw_camera_view",
    "drive",
    "named_fault",
    "named_policy",
    "run_crossing",
]
