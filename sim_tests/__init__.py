"""Closed-loop crossings of a mobile robot and people in PyBullet.

Needs the extra ``awarenav[sim]``; names are imported when they are first used, so that the command
line can say so where it is missing.
"""

from __future__ import annotations

from pathlib import Path
from runpy import run_path

# By path: importing it by name would first run whatever now calls itself perception.
_CLASH = Path(__file__).parents[1] / "perception" / "_clash.py"
run_path(str(_CLASH))["require_sole_owner"](__name__)

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from .actors.body import Worker
    from .actors.robot import NOVA_CARTER
    from .crossing import CrossingFrame, CrossingResult, StraightOn, run_crossing
    from .crossing.planner import LocalPlanner, ReferencePlanner
    from .crossing.sensors import KeypointNoise
    from .scenario import Scenario, shipped_scenarios
    from .world import Warehouse
    from .world.camera import CameraRenderer
    from .world.errors import SimError

__all__ = [
    "NOVA_CARTER",
    "CameraRenderer",
    "CrossingFrame",
    "CrossingResult",
    "KeypointNoise",
    "LocalPlanner",
    "ReferencePlanner",
    "Scenario",
    "SimError",
    "StraightOn",
    "Warehouse",
    "Worker",
    "run_crossing",
    "shipped_scenarios",
]

__getattr__ = lazy_page(__name__, __file__)
