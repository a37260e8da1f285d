"""The planner of an episode: the reference planner, or the user's own as ``module:Class``."""

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

# Names in tables of the reference planner, and of the driver of scenarios without a planner.
_REFERENCE: Final = "SamplingPlanner"
_STRAIGHT_ON: Final = "StraightOn"
# An argument of this name receives the racks and walls of the hall.
_BOXES: Final = "static_boxes_odom_m"


def planner_label(planner: str, scenario: Scenario) -> str:
    """Return the name of a planner in tables: the part after the colon, or the default's name."""
    if planner:
        return planner.rpartition(":")[2]
    return _REFERENCE if scenario.robot.straight_on_speed_mps is None else _STRAIGHT_ON


def make_planner(planner: str, scenario: Scenario) -> LocalPlanner | None:
    """Return a new planner for one episode; None for the default planner.

    ``module:Class`` names a class, or a function that returns a planner. It is called with the
    robot's :class:`~nav_adapter.RobotProfile`, and also with ``static_boxes_odom_m=`` if it has an
    argument of that name: (N, 4) x_min, y_min, x_max, y_max of racks and walls. The module is
    searched on the import path and in the working directory.

    Raises:
        SimError: there is no such module or class, or the planner has no ``plan``.
    """
    if not planner:
        return None
    make, wants_boxes = _import_maker(planner)
    boxes = {_BOXES: scenario.planner_boxes_odom_m} if wants_boxes else {}
    made = make(NOVA_CARTER, **boxes)
    if not callable(getattr(made, "plan", None)):
        raise SimError(
            f"planner {planner!r} made a {type(made).__name__}, which has no method "
            "plan(robot_state, goal_odom_m, constraints, dt_s)"
        )
    own_planner: LocalPlanner = made
    return own_planner


@lru_cache(maxsize=64)
def _import_maker(planner: str) -> tuple[Callable[..., Any], bool]:
    """Return the class or function of ``module:Class``, and whether it takes the boxes."""
    module_name, colon, name = planner.partition(":")
    if not (colon and module_name and name):
        raise SimError(
            f"planner must be given as module:Class, e.g. my_robot.planning:MyPlanner, "
            f"got {planner!r}"
        )
    here = str(Path.cwd())
    if (
        here not in sys.path and "" not in sys.path
    ):  # python -m adds it to the path, a script does not
        sys.path.append(here)
    try:
        found: Any = import_module(module_name)
        for part in name.split("."):
            found = getattr(found, part)
    except Exception as cause:  # the user's module may raise anything
        raise SimError(
            f"planner {planner!r} cannot be imported: {type(cause).__name__}: {cause}"
        ) from cause
    if not callable(found):
        raise SimError(f"planner {planner!r} must name a class or a function, got {found!r:.80}")
    try:
        wants_boxes = _BOXES in inspect.signature(found).parameters
    except (TypeError, ValueError):  # some compiled classes have no signature
        wants_boxes = False
    return found, wants_boxes
