"""People over the horizon of a planner."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number
from tracking.prediction import PredictionModel, predict_states

from .._constraints import NavConstraints
from .._errors import NavError
from .._predicted import largest_sigmas_m
from ._shapes import circles

# Distance of an empty slot from the robot: out of reach, but small enough for a solver's scaling.
_FAR_M = 100.0


def predicted_circles(
    constraints: NavConstraints,
    times_s: Any,
    *,
    growth_mps: float = 0.0,
    model: PredictionModel | None = None,
    sigmas: float = 2.0,
    slots: int | None = None,
    robot_position_odom_m: Any = None,
) -> FloatArray:
    """Return (N, T, 5): x, y (m), vx, vy (m/s) and radius (m) of every person at every time.

    People are predicted with their present velocity. Their radius grows by ``growth_mps``, since
    they may move otherwise; or with a ``model`` by as many standard deviations as the uncertainty
    of their position grows.

    A circle may contain the robot. A solver needs a slack on its distance then, or it has no
    solution (``docs/planners.md``, "Inside a circle").

    Some controllers need a fixed number of obstacles. With ``slots`` the first axis has that
    length: first the people whose circles come nearest to the robot within the times, nearest
    first, then circles of radius 0 at a distance of 100 m. ``speed_limit_mps`` takes all people
    into account, also those left out here.

    Args:
        constraints: the people.
        times_s: (T,) seconds after ``constraints.stamp_s``, ≥ 0.
        growth_mps: ≥ 0, growth of the radius.
        model: of the prediction, such as ``tracking.prediction.FITTED``; None for no such growth.
        sigmas: ≥ 0, number of standard deviations, along the most uncertain direction.
        slots: ≥ 1, or None for one entry per person in the order of ``constraints.obstacles``.
        robot_position_odom_m: (2,) position of the robot; needed with ``slots``.

    Raises:
        NavError: for an argument that is not finite or out of bounds, and with a model for an
            obstacle without ``covariance_odom``.
    """
    times = finite_array("times_s", times_s, ("T",), NavError)
    if bool((times < 0.0).any()):
        raise NavError(f"times_s must not be negative, got {times.min():g} s")
    growth = finite_number("growth_mps", growth_mps, NavError, minimum=0.0)
    now = circles(constraints)
    out = np.repeat(now[:, None, :], len(times), axis=1)
    out[:, :, :2] += times[:, None] * now[:, None, 2:4]
    out[:, :, 4] += growth * times
    if model is not None:
        out[:, :, 4] += _spread_m(constraints, now, times, model, sigmas)
    if slots is None:
        return out
    if isinstance(slots, bool) or not isinstance(slots, int) or slots < 1:
        raise NavError(f"slots must be a whole number of at least 1, got {slots!r}")
    if robot_position_odom_m is None:
        raise NavError("slots needs robot_position_odom_m, (2,) in metres, to find the nearest")
    robot = finite_array("robot_position_odom_m", robot_position_odom_m, (2,), NavError)
    filled = np.zeros((slots, len(times), 5))
    filled[:, :, :2] = robot + np.array([_FAR_M, 0.0])
    gap = np.hypot(out[:, :, 0] - robot[0], out[:, :, 1] - robot[1]) - out[:, :, 4]
    nearest = np.argsort(gap.min(axis=1, initial=np.inf), kind="stable")[:slots]
    filled[: len(nearest)] = out[nearest]
    return filled


def _spread_m(
    constraints: NavConstraints,
    now: FloatArray,
    times: FloatArray,
    model: PredictionModel,
    sigmas: float,
) -> FloatArray:
    """Return by how much the radii (N, T) grow with the uncertainty of the positions."""
    count = finite_number("sigmas", sigmas, NavError, minimum=0.0)
    covariances = np.zeros((len(now), 4, 4))
    for index, obstacle in enumerate(constraints.obstacles):
        if obstacle.covariance_odom is None:
            raise NavError(
                "predicted_circles with a model needs the covariance of every person, as "
                f"NavAdapter.update gives it; obstacles[{index}] has covariance_odom=None"
            )
        covariances[index] = obstacle.covariance_odom
    ahead = predict_states(now[:, :4], covariances, times, model).covariances_odom_m2
    present_m = largest_sigmas_m(covariances[:, None, :2, :2])
    return np.asarray(count * np.maximum(largest_sigmas_m(ahead) - present_m, 0.0))
