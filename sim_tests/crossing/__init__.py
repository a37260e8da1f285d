"""One closed-loop crossing: camera, pipeline, tracker, adapter, planner and physics in a loop."""

from __future__ import annotations

from ._assembly import Setup, axis_names, changed, named_fault, named_policy
from ._crossing import Crossing, Observer, drive, run_crossing
from ._drawing import MapScale, RequestMemory, TopView, camera_view, draw_camera_view
from ._result import CrossingFrame, CrossingResult
from ._separations import STANDING_SPEED_MPS, ContactEvent, contact_by
from ._stage import Stage, TrueView
from .planner import StraightOn
