"""Costs of sampled trajectories, for planners that sample (MPPI, CEM, lattices)."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError


def people_cost(
    constraints: NavConstraints,
    positions_odom_m: Any,
    dt_s: float,
    *,
    robot_radius_m: float = 0.0,
    first_s: float = 0.0,
    inside_cost: float = 1000.0,
    near_cost: float = 1.0,
    decay_m: float = 0.4,
) -> FloatArray:
    """Return (K, T), the cost of K sampled trajectories at T times, dimensionless.

    The cost of a person depends on the gap g between the robot's disc and the person's circle,
    predicted with the present velocity:

    * g > 0: ``near_cost``·exp(−g / ``decay_m``), which is smooth.
    * g ≤ 0: ``inside_cost``·(1 + depth in metres), which rises with depth, so that samples that
      are all inside still show the way out (``docs/planners.md``, "Inside a circle").

    The costs of all people are summed.

    Args:
        constraints: the people.
        positions_odom_m: (K, T, 2) positions of the robot's centre; entry t is at
            ``first_s + t·dt_s`` after ``constraints.stamp_s``.
        dt_s: > 0, time step.
        robot_radius_m: ≥ 0, of the disc around the robot.
        first_s: ≥ 0, time of the first entry: ``dt_s`` if that is the state after one step.
        inside_cost: > ``near_cost``, cost at the edge of a circle, from inside.
        near_cost: ≥ 0, cost at the edge of a circle, from outside.
        decay_m: > 0, the gap over which the cost falls to 1/e.

    Raises:
        NavError: for an argument that is not finite or out of bounds.
    """
    positions = finite_array("positions_odom_m", positions_odom_m, ("K", "T", 2), NavError)
    dt = finite_number("dt_s", dt_s, NavError, minimum=0.0, exclusive_minimum=True)
    robot_radius = finite_number("robot_radius_m", robot_radius_m, NavError, minimum=0.0)
    first = finite_number("first_s", first_s, NavError, minimum=0.0)
    near = finite_number("near_cost", near_cost, NavError, minimum=0.0)
    inside = finite_number(
        "inside_cost", inside_cost, NavError, minimum=near, exclusive_minimum=True
    )
    decay = finite_number("decay_m", decay_m, NavError, minimum=0.0, exclusive_minimum=True)
    x, y = positions[:, :, 0], positions[:, :, 1]
    times = first + dt * np.arange(positions.shape[1])
    cost = np.zeros(positions.shape[:2])
    # One person at a time, so that memory holds only a few arrays of the samples' size.
    for obstacle in constraints.obstacles:
        (cx, cy), (vx, vy) = obstacle.center_odom_m, obstacle.velocity_odom_mps
        gap = np.hypot(x - (cx + vx * times), y - (cy + vy * times))
        gap -= obstacle.radius_m + robot_radius
        outside = near * np.exp(np.maximum(gap, 0.0) * (-1.0 / decay))
        cost += np.where(gap > 0.0, outside, inside * (1.0 - gap))
    return cost
