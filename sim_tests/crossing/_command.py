"""The command that a planner returns, checked before it reaches the robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from perception.arrays import finite_number

from ..world.errors import SimError
from .planner import LocalPlanner

_CALL: Final = "plan(robot_state, goal_odom_m, constraints, dt_s)"
_VALID: Final = "(speed_mps, yaw_rate_radps), two finite numbers in m/s and rad/s"
_VALID_SIDEWAYS: Final = (
    f"{_VALID}, or (forward_mps, left_mps, yaw_rate_radps) for a robot that moves sideways"
)


def check_planner(planner: Any) -> LocalPlanner:
    """Return a planner; raise SimError for an object without ``plan``, and for a class."""
    if isinstance(planner, type):
        raise SimError(
            f"planner must be an object with {_CALL}, got the class {planner.__name__}: "
            f"make one with {planner.__name__}(…)"
        )
    if not callable(getattr(planner, "plan", None)):
        raise SimError(f"planner must be an object with {_CALL}, got {planner!r:.80}")
    checked: LocalPlanner = planner
    return checked


def checked_command(
    planner: LocalPlanner, returned: Any, t_s: float, *, sideways: bool = False
) -> tuple[float, float, float]:
    """Return a planner's command: speed (m/s), yaw rate (rad/s), and speed to the left (m/s).

    Any sequence or array of two finite numbers is accepted, scalars of numpy and torch included.

    Args:
        planner: the planner, for the message.
        returned: what its ``plan`` returned.
        t_s: simulated time, for the message.
        sideways: the robot can move sideways; then three numbers are speeds forward and to the
            left, and the yaw rate.

    Raises:
        SimError: it is not two finite numbers, or three for a robot that moves sideways.
    """
    try:
        speed, left, yaw_rate = _cells(returned, sideways)
        return (
            finite_number("speed_mps", speed, SimError),
            finite_number("yaw_rate_radps", yaw_rate, SimError),
            finite_number("left_mps", left, SimError),
        )
    except Exception as cause:  # an array type of the user's may raise anything
        raise SimError(
            f"planner {type(planner).__name__} returned {_described(returned)} at {t_s:.2f} s; "
            f"plan must return {_VALID_SIDEWAYS if sideways else _VALID}"
        ) from cause


def _cells(returned: Any, sideways: bool) -> tuple[Any, Any, Any]:
    """Return speed, speed to the left, and yaw rate; raise TypeError or ValueError without them."""
    if isinstance(returned, (str, bytes, Mapping)) or not hasattr(returned, "__getitem__"):
        raise TypeError("not a sequence")  # sets and generators have no order or no length
    cells = tuple(returned)
    if len(cells) == 2:
        cells = (cells[0], 0.0, cells[1])
    elif not (sideways and len(cells) == 3):
        raise ValueError("another number of numbers")
    for cell in cells:
        if isinstance(cell, (str, bytes, bool, np.bool_)) or np.ndim(cell) != 0:
            raise TypeError("not a number")
    forward, left, yaw_rate = cells
    return forward, left, yaw_rate


def _described(returned: Any) -> str:
    """Return the beginning of the value on one line, its type, and its shape if it has one."""
    shape = getattr(returned, "shape", None)
    try:
        text = " ".join(f"{returned!r}".split())
    except Exception:  # the user's type may not be printable
        text = "a value that cannot be printed"
    text = text if len(text) <= 80 else f"{text[:79]}…"
    kind = type(returned).__name__
    return f"{text} ({kind} of shape {tuple(shape)})" if shape is not None else f"{text} ({kind})"
