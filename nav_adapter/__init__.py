"""How large, how fast, and why: person tracks become obstacles and a speed limit for any planner."""

from __future__ import annotations

from ._constraints import NavConstraints, PersonObstacle
from ._errors import NavError
from ._robot import RobotProfile, RobotState

__all__ = ["NavConstraints", "NavError", "PersonObstacle", "RobotProfile", "RobotState"]
