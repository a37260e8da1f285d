"""One closed-loop crossing: camera, pipeline, tracker, adapter, planner and physics in a loop."""

from __future__ import annotations

from ._crossing import (
    Crossing,
    Observer,
    Situation,
    run_crossing,
)
from ._drawing import TopView, draw_camera_view
from ._policies import named_policy
from ._requests import RequestMemory
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
    "Situation",
    "Stage",
    "StraightOn",
    "TopView",
    "TrueView",
    "contact_by",
    "draw_camera_view",
    "named_policy",
    "run_crossing",
]
