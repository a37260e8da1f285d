"""The planner of an episode: the reference planner, or the user's own as ``module:Class``."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from ...actors.robot import NOVA_CARTER
from ...crossing.planner import LocalPlanner
from ...scenario import Scenario
from ...world.errors import SimError
from ._seeding import FRESH_TORCH_SEED, seeded_generators

# Names in tables of the reference planner, and of the driver of scenarios without a planner.
_REFERENCE: Final = "SamplingPlanner"
_STRAIGHT_ON: Final = "StraightOn"
# Arguments by these names receive the robot's profile, the racks and walls, the way from start to
# goal, and the episode's seed.
_ROBOT: Final = ("robot", "robot_profile", "profile")
_BOXES: Final = "static_boxes_odom_m"
_PATH: Final = "reference_path_odom_m"
_SEED: Final = "seed"


def planner_label(planner: str, scenario: Scenario) -> str:
    """Return the name of a planner in tables: the part after the colon, or the default's name."""
    if planner:
        return planner.rpartition(":")[2]
    return _REFERENCE if scenario.robot.straight_on_speed_mps is None else _STRAIGHT_ON


def make_planner(planner: str, scenario: Scenario, seed: int = 0) -> LocalPlanner | None:
    """Return a new planner for one episode; None for the default planner.

    ``module:Class`` names a class, or a function that returns a planner. The module is searched on
    the import path and in the working directory. It is called with those of these arguments that
    its signature has:

    * ``robot`` (or ``robot_profile``, ``profile``, or a first positional argument without a
      default, whatever its name): the robot's :class:`~nav_adapter.RobotProfile`;
    * ``static_boxes_odom_m``: (N, 4) x_min, y_min, x_max, y_max of racks and walls;
    * ``reference_path_odom_m``: (M, 2) points from the start to the goal, straight, at most 0.25 m
      apart;
    * ``seed``: the seed of the episode, an int ≥ 0.

    Other arguments keep their defaults. A compiled class without a signature is called with the
    robot alone.

    Raises:
        SimError: there is no such module or class, it asks for other arguments, it raises an
            error, or the planner has no ``plan``.
    """
    if not planner:
        return None
    make, signature = import_planner(planner)
    available: dict[str, Any] = {
        _BOXES: scenario.planner_boxes_odom_m,
        _PATH: scenario.robot.path_odom_m,
        _SEED: seed,
    }
    available |= dict.fromkeys(_ROBOT, NOVA_CARTER)
    arguments, keywords = _arguments(planner, signature, available)
    try:
        made = make(*arguments, **keywords)
    except Exception as cause:  # the user's code may raise anything
        raise SimError(
            f"planner {planner!r} cannot be made: {type(cause).__name__}: {cause}"
        ) from cause
    if not callable(getattr(made, "plan", None)):
        raise SimError(
            f"planner {planner!r} made a {type(made).__name__}, which has no method "
            "plan(robot_state, goal_odom_m, constraints, dt_s)"
        )
    own_planner: LocalPlanner = made
    return own_planner


def refuse_unusable_planner(planner: str, scenario: Scenario) -> None:
    """Make a planner once; the global random generators keep their state.

    Raises:
        SimError: as :func:`make_planner`.
    """
    if planner:
        import_planner(planner)
        with seeded_generators(0):
            make_planner(planner, scenario)


def _arguments(
    planner: str, signature: inspect.Signature | None, available: Mapping[str, Any]
) -> tuple[list[Any], dict[str, Any]]:
    """Return the positional and keyword arguments that a signature asks for.

    Raises:
        SimError: it has another argument without a default.
    """
    positional: list[Any] = []
    keywords: dict[str, Any] = {}
    if signature is None:
        return [NOVA_CARTER], keywords
    names_robot = any(name in _ROBOT for name in signature.parameters)
    for number, parameter in enumerate(signature.parameters.values()):
        kind, required = parameter.kind, parameter.default is parameter.empty
        if kind is parameter.VAR_KEYWORD:
            continue
        if parameter.name in available and kind is not parameter.VAR_POSITIONAL:
            if kind is not parameter.POSITIONAL_ONLY:
                keywords[parameter.name] = available[parameter.name]
            elif len(positional) == number:  # none before it keeps its default
                positional.append(available[parameter.name])
        elif (
            number == 0 and required and kind is not parameter.KEYWORD_ONLY and not names_robot
        ):  # of any name, or *args of a decorator that hands everything on
            positional.append(NOVA_CARTER)
        elif required and kind is not parameter.VAR_POSITIONAL:
            raise SimError(
                f"planner {planner!r} asks for the argument {parameter.name!r} in "
                f"{signature}; it can have the robot as {_ROBOT[0]!r}, {_BOXES!r}, {_PATH!r} and "
                f"{_SEED!r}, and needs a default for any other"
            )
    return positional, keywords


@lru_cache(maxsize=64)
def import_planner(planner: str) -> tuple[Callable[..., Any], inspect.Signature | None]:
    """Return the class or function of ``module:Class``, and its signature if it has one.

    Raises:
        SimError: it cannot be imported, or is neither.
    """
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
        # A module may draw while it is imported: the same in every process, with torch or without.
        with seeded_generators(0, torch_seed=FRESH_TORCH_SEED):
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
        return found, inspect.signature(found)
    except (TypeError, ValueError):  # some compiled classes have no signature
        return found, None
