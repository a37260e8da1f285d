"""Navigation: turns person tracks into obstacles and a speed limit for any planner.

The parts of a policy are in :mod:`nav_adapter.policies`.
"""

from __future__ import annotations

from pathlib import Path
from runpy import run_path

# Run by path: an import by name could load another package that is called perception.
_CLASH = Path(__file__).parents[1] / "perception" / "_clash.py"
run_path(str(_CLASH))["require_sole_owner"](__name__)

from ._adapter import NavAdapter
from ._constraints import NavConstraints, PersonObstacle
from ._errors import NavError
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from ._separation import max_speed_mps, protective_separation_m
from .alerts import Alert
from .exporters import boxes, circles, paint_costmap, points, polygons
from .policies import InflationPolicy, SpeedPolicy

__all__ = [
    "Alert",
    "AwarenessPolicy",
    "InflationPolicy",
    "NavAdapter",
    "NavConstraints",
    "NavError",
    "PersonObstacle",
    "RobotProfile",
    "RobotState",
    "SpeedPolicy",
    "boxes",
    "circles",
    "max_speed_mps",
    "paint_costmap",
    "points",
    "polygons",
    "protective_separation_m",
]
