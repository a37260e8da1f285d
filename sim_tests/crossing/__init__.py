"""One closed-loop crossing: camera, pipeline, tracker, adapter, planner and physics in a loop."""

from __future__ import annotations

from ._crossing import CrossingFrame, CrossingResult, Observer, StraightOn, run_crossing
from ._drawing import TopView, draw_camera_view
from ._metrics import STANDING_SPEED_MPS
from ._stage import Stage

__all__ = [
    "STANDING_SPEED_MPS",
    "CrossingFrame",
    "CrossingResult",
    "Observer",
    "Stage",
    "StraightOn",
    "TopView",
    "draw_camera_view",
    "run_crossing",
]
