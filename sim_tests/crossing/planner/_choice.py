"""The planner of an episode: a known one by its name, or the user's own as ``module:Class``."""

from __future__ import annotations

import ast
import contextlib
import copy
import inspect
import random
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np

from awarenav.errors import not_one_of
from nav_adapter import RobotProfile
from perception.arrays import FloatArray

from ...conditions import REFERENCE_PLANNER
from ...scenario import Scenario
from ...world.errors import SimError
from ._costmap import CostmapPlanner
from ._local_planner import LocalPlanner, StraightOn
from ._reference import ReferencePlanner

# Arguments by these names receive the robot's profile, the racks and walls, the way from start to
# goal, and the episode's seed.
_ROBOT: Final = ("robot", "robot_profile", "profile")
_BOXES: Final = "static_boxes_odom_m"
_PATH: Final = "reference_path_odom_m"
_SEED: Final = "seed"


class PlannerFactory(NamedTuple):
    """The class or function that makes a planner.

    Attributes:
        make: returns a new planner.
        signature: of ``make``; None for some compiled classes.
        settings: arguments that were given with the name.
    """

    make: Callable[..., Any]
    signature: inspect.Signature | None
    settings: Mapping[str, Any] = MappingProxyType({})


def straight_to_goal(robot: RobotProfile) -> StraightOn:
    """Return a planner that drives straight to the goal at the robot's maximum speed.

    It reads neither people nor limits, so it shows what measures make of a planner that does not.
    """
    return StraightOn(robot.max_speed_mps, stops_at_goal=True)


def ros2_stack(
    robot: RobotProfile, reference_path_odom_m: FloatArray, seed: int = 0, **settings: Any
) -> LocalPlanner:
    """Return a seat for a ROS 2 stack outside, such as your Nav2, which drives in real time."""
    from .ros2 import Ros2Planner  # noqa: PLC0415 - needs the extra ros2

    return Ros2Planner(robot, reference_path_odom_m, seed, **settings)


#: Planners that have a name without a module, beside the reference planner.
KNOWN_PLANNERS: Final[Mapping[str, Callable[..., LocalPlanner]]] = MappingProxyType(
    {
        "costmap": CostmapPlanner,
        "straight_on": straight_to_goal,
        "ros2": ros2_stack,
    }
)


def is_outside(planner: str) -> bool:
    """Return whether a planner is a stack outside: one episode at a time, never quite the same."""
    return KNOWN_PLANNERS.get(planner.partition("(")[0]) is ros2_stack


@contextlib.contextmanager
def seeded_generators(seed: int) -> Iterator[None]:
    """Seed the global generators of ``random`` and ``numpy``, and restore them afterwards."""
    python_state, numpy_state = random.getstate(), np.random.get_state()  # noqa: NPY002 - planners use it
    random.seed(seed)
    np.random.seed(seed % 2**32)  # noqa: NPY002
    try:
        yield
    finally:
        random.setstate(python_state)
        np.random.set_state(numpy_state)  # noqa: NPY002


def planner_label(planner: str, scenario: Scenario) -> str:
    """Return the name of a planner in tables: the part after the colon, or the default's name."""
    if planner:
        return planner.rpartition(":")[2]
    straight = scenario.robot.straight_on_speed_mps is not None
    return (StraightOn if straight else ReferencePlanner).__name__


def make_planner(planner: str, scenario: Scenario, seed: int = 0) -> LocalPlanner:
    """Return a new planner for one episode.

    An empty name is the :class:`ReferencePlanner`, or :class:`StraightOn` where the
    scenario drives straight ahead. ``"costmap"`` and ``"straight_on"`` have a name, too.

    ``module:Class`` names a class, a function that returns a planner, or a planner. The module is
    searched on the import path and in the working directory. A planner is copied for each episode.
    A class or function is called with those of these arguments that its signature has:

    * ``robot`` (or ``robot_profile``, ``profile``, or a first positional argument without a
      default, whatever its name): the robot's :class:`~nav_adapter.RobotProfile`;
    * ``static_boxes_odom_m``: (N, 4) x_min, y_min, x_max, y_max of racks and walls;
    * ``reference_path_odom_m``: (M, 2) points from the start to the goal, straight, at most 0.25 m
      apart;
    * ``seed``: the seed of the episode, an int ≥ 0.

    Other arguments keep their defaults, unless they are given: ``module:Class(gain=2.0)``. A
    compiled class without a signature is called with the robot and what is given.

    Raises:
        SimError: there is no such module or class, it asks for other arguments, it raises an
            error, or the planner has no ``plan``.
    """
    if not planner:
        straight_mps = scenario.robot.straight_on_speed_mps
        if straight_mps is not None:
            return StraightOn(straight_mps)
        return ReferencePlanner(scenario.robot_profile, scenario.planner_boxes_odom_m)
    factory = import_planner(planner)
    available: dict[str, Any] = {
        _BOXES: scenario.planner_boxes_odom_m,
        _PATH: scenario.robot.path_odom_m,
        _SEED: seed,
    }
    robot = scenario.robot_profile
    available |= dict.fromkeys(_ROBOT, robot)
    arguments, keywords = _arguments(planner, factory, available, robot)
    try:
        made = factory.make(*arguments, **keywords)
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
    """Make a planner once; the global random generators keep their state."""
    if planner:
        import_planner(planner)
        with seeded_generators(0):
            make_planner(planner, scenario)


def _arguments(
    planner: str, factory: PlannerFactory, available: Mapping[str, Any], robot: RobotProfile
) -> tuple[list[Any], dict[str, Any]]:
    """Return the positional and keyword arguments that a signature asks for."""
    signature, settings = factory.signature, factory.settings
    positional: list[Any] = []
    keywords: dict[str, Any] = dict(settings)
    if signature is None:
        return [robot], keywords
    _refuse_unknown_settings(planner, signature, settings)
    names_robot = any(name in _ROBOT for name in signature.parameters)
    for number, parameter in enumerate(signature.parameters.values()):
        kind, required = parameter.kind, parameter.default is parameter.empty
        if kind is parameter.VAR_KEYWORD or parameter.name in settings:
            continue
        if parameter.name in available and kind is not parameter.VAR_POSITIONAL:
            if kind is not parameter.POSITIONAL_ONLY:
                keywords[parameter.name] = available[parameter.name]
            elif len(positional) == number:  # none before it keeps its default
                positional.append(available[parameter.name])
        elif (
            number == 0 and required and kind is not parameter.KEYWORD_ONLY and not names_robot
        ):  # of any name, or *args of a decorator that hands everything on
            positional.append(robot)
        elif required and kind is not parameter.VAR_POSITIONAL:
            raise SimError(
                f"planner {planner!r} asks for the argument {parameter.name!r} in "
                f"{signature}; it can have the robot as {_ROBOT[0]!r}, {_BOXES!r}, {_PATH!r} and "
                f"{_SEED!r}, and needs a default for any other"
            )
    return positional, keywords


def _refuse_unknown_settings(
    planner: str, signature: inspect.Signature, settings: Mapping[str, Any]
) -> None:
    """Raise SimError for an argument that was given and that the signature does not have."""
    parameters = signature.parameters.values()
    if any(each.kind is each.VAR_KEYWORD for each in parameters):
        return
    names = [
        each.name
        for each in parameters
        if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)
    ]
    unknown = [name for name in settings if name not in names]
    if unknown:
        raise SimError(
            f"planner {planner!r} has no argument {unknown[0]!r}; it has "
            f"{', '.join(map(repr, names)) or 'none'}"
        )


@lru_cache(maxsize=64)
def import_planner(planner: str) -> PlannerFactory:
    """Return what makes the planner of a known name or of ``module:Class``.

    Raises:
        SimError: it cannot be imported, or is neither a class nor a function nor a planner.
    """
    target, settings = _split_settings(planner)
    if target in KNOWN_PLANNERS:
        known = KNOWN_PLANNERS[target]
        return PlannerFactory(known, inspect.signature(known), settings)
    module_name, colon, name = target.partition(":")
    if not (colon and module_name and name):
        raise SimError(
            not_one_of(
                "planner",
                planner,
                (REFERENCE_PLANNER, *KNOWN_PLANNERS),
                or_else="module:Class, e.g. my_robot.planning:MyPlanner",
            )
        )
    found = _found(planner, module_name, name)
    if not isinstance(found, type) and callable(getattr(found, "plan", None)):
        return PlannerFactory(partial(copy.deepcopy, found), inspect.Signature(), settings)
    if not callable(found):
        raise SimError(
            f"planner {planner!r} must name a class or a function, or an object with plan, "
            f"got {found!r:.80}"
        )
    try:
        return PlannerFactory(found, inspect.signature(found), settings)
    except (TypeError, ValueError):  # some compiled classes have no signature
        return PlannerFactory(found, None, settings)


def _found(planner: str, module_name: str, name: str) -> Any:
    """Return the object of a module by its dotted name; raise SimError if there is none."""
    here = str(Path.cwd())
    if (
        here not in sys.path and "" not in sys.path
    ):  # python -m adds it to the path, a script does not
        sys.path.append(here)
    try:
        # A module may draw while it is imported: the same in every process.
        with seeded_generators(0):
            found: Any = import_module(module_name)
        for part in name.split("."):
            found = getattr(found, part)
    except Exception as cause:  # the user's module may raise anything
        message = f"planner {planner!r} cannot be imported: {type(cause).__name__}: {cause}"
        if isinstance(cause, ModuleNotFoundError) and cause.name == module_name.partition(".")[0]:
            message += "; run in the folder of its file, or name that folder in PYTHONPATH"
        raise SimError(message) from cause
    return found


def _split_settings(planner: str) -> tuple[str, dict[str, Any]]:
    """Return ``module:Class`` and the arguments in parentheses behind it, if there are any.

    Raises:
        SimError: the arguments are not ``name=value``, with numbers, strings, booleans or None.
    """
    target, opening, rest = planner.partition("(")
    if not opening:
        return planner, {}
    try:
        call = ast.parse(f"f({rest}", mode="eval").body
        if not isinstance(call, ast.Call) or call.args or ":" in rest:
            raise ValueError("not a call with keywords alone")
        settings = {str(each.arg): ast.literal_eval(each.value) for each in call.keywords}
        if not all(isinstance(each, int | float | str | None) for each in settings.values()):
            raise ValueError("not a plain value")
    except (SyntaxError, ValueError) as cause:
        raise SimError(
            "arguments of a planner must be given as module:Class(name=value, …), with numbers, "
            f"strings without a colon, True, False or None, got {planner!r}"
        ) from cause
    return target, settings
