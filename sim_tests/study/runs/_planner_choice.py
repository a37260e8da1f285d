"""A planner of the user's own, named as ``module:Class``."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from ...actors.robot import NOVA_CARTER
from ...crossing.planner import LocalPlanner
from ...scenario import Scenario
from ...world.errors import SimError

#: What tables call the planner that drives when no other is given.
REFERENCE: Final = "SamplingPlanner"
_STRAIGHT_ON: Final = "StraightOn"
# An argument of this name gets the hall's racks and walls.
_BOXES: Final = "static_boxes_odom_m"


def planner_label(planner: str, scenario: Scenario) -> str:
    """What tables call a planner: the name after the colon, or that of the default one."""
    if planner:
        return planner.rpartition(":")[2]
    return REFERENCE if scenario.robot.straight_on_speed_mps is None else _STRAIGHT_ON


def make_planner(planner: str, scenario: Scenario) -> LocalPlanner | None:
    """A new planner for one episode; None for the default one.

    What ``module:Class`` names is called with the robot's :class:`~nav_adapter.RobotProfile`, and
    with ``static_boxes_odom_m=`` (N, 4) x_min, y_min, x_max, y_max of racks and walls if it has an
    argument of that name. A function that returns a planner will do as well. The module is looked
    for on the import path and in the working directory.

    Raises:
        SimError: there is no such module or class, or what it makes has no ``plan``.
    """
    if not planner:
        return None
    make, wants_boxes = _maker(planner)
    boxes = {_BOXES: scenario.planner_boxes_odom_m} if wants_boxes else {}
    made = make(NOVA_CARTER, **boxes)
    if not callable(getattr(made, "plan", None)):
        raise SimError(
            f"planner {planner!r} made a {type(made).__name__}, which has no method "
            "plan(robot_state, goal_odom_m, constraints, dt_s)"
        )
    driver: LocalPlanner = made
    return driver


@lru_cache(maxsize=64)
def _maker(planner: str) -> tuple[Callable[..., Any], bool]:
    module_name, colon, name = planner.partition(":")
    if not (colon and module_name and name):
        raise SimError(
            f"planner must be given as module:Class, e.g. my_robot.planning:MyPlanner, "
            f"got {planner!r}"
        )
    here = str(Path.cwd())
    if here not in sys.path and "" not in sys.path:  # as python -m has it, and a script has not
        sys.path.append(here)
    try:
        found: Any = import_module(module_name)
        for part in name.split("."):
            found = getattr(found, part)
    except Exception as cause:  # whatever a module of the user's does when it is imported
        raise SimError(
            f"planner {planner!r} cannot be imported: {type(cause).__name__}: {cause}"
        ) from cause
    if not callable(found):
        raise SimError(f"planner {planner!r} must name a class or a function, got {found!r:.80}")
    try:
        wants_boxes = _BOXES in inspect.signature(found).parameters
    except (TypeError, ValueError):  # some built in a compiled language do not say
        wants_boxes = False
    return found, wants_boxes
