"""Velocities that lead into a person: half-planes in velocity space."""

from __future__ import annotations

from typing import Any

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number

from .._constraints import NavConstraints
from .._errors import NavError
from ._shapes import circles

# Shorter vectors count as having no direction.
_NO_DIRECTION = 1e-9


def half_planes(
    constraints: NavConstraints,
    position_odom_m: Any,
    velocity_odom_mps: Any,
    robot_radius_m: float,
    *,
    horizon_s: float = 3.0,
    resolve_s: float = 0.5,
    share: float = 1.0,
) -> FloatArray:
    """Return (N, 3) rows nx, ny, b: a velocity v (m/s, odom) is allowed if nx·vx + ny·vy ≥ b.

    These are the half-planes of ORCA (van den Berg, Guy, Lin and Manocha 2011, "Reciprocal n-body
    collision avoidance"), with n of length 1. With a ``share`` of 1, a disc-shaped robot that keeps
    an allowed velocity touches no obstacle within the horizon, as long as people keep their
    velocity. If the robot is inside an obstacle already, allowed velocities bring it out within
    ``resolve_s`` (``docs/planners.md``, "Inside a circle").

    ORCA has no acceleration limit, so a drive that cannot follow at once is not covered. The rows
    may contradict each other in a crowd; the robot should stop then.

    Args:
        constraints: the people.
        position_odom_m: (2,) the robot's centre.
        velocity_odom_mps: (2,) the robot's velocity, at which the half-planes are computed.
        robot_radius_m: ≥ 0, of the disc around the robot.
        horizon_s: > 0, time within which no obstacle may be touched.
        resolve_s: > 0, time for a robot inside an obstacle to get out.
        share: the robot's share of the avoidance, in [0.5, 1]. ORCA's 0.5 leaves the other half to
            the person, which cannot be expected of one who has not seen the robot.

    Raises:
        NavError: for an argument that is not finite or out of bounds.
    """
    position = finite_array("position_odom_m", position_odom_m, (2,), NavError)
    velocity = finite_array("velocity_odom_mps", velocity_odom_mps, (2,), NavError)
    robot_radius = finite_number("robot_radius_m", robot_radius_m, NavError, minimum=0.0)
    horizon, resolve = (
        finite_number(name, value, NavError, minimum=0.0, exclusive_minimum=True)
        for name, value in (("horizon_s", horizon_s), ("resolve_s", resolve_s))
    )
    taken = finite_number("share", share, NavError, minimum=0.5, maximum=1.0)
    rows = circles(constraints)
    apart = rows[:, :2] - position
    relative = velocity - rows[:, 2:4]
    radius = rows[:, 4] + robot_radius
    distance = np.hypot(apart[:, 0], apart[:, 1])
    inside = distance <= radius

    # The velocity obstacle is a cone that is cut off by a disc, the cap at the horizon.
    time = np.where(inside, resolve, horizon)
    from_cap = relative - apart / time[:, None]
    cap_length = np.hypot(from_cap[:, 0], from_cap[:, 1])
    towards = (from_cap * apart).sum(axis=1)
    on_cap = inside | ((towards < 0.0) & (towards * towards > (radius * cap_length) ** 2))
    away = -_unit(apart, np.array([1.0, 0.0]))
    cap_normal = _unit(from_cap, away)
    cap_change = radius / time - cap_length

    # The legs are the tangents from the apex to the disc; the sign selects the leg on the side of
    # the relative velocity.
    side = np.where(apart[:, 0] * from_cap[:, 1] - apart[:, 1] * from_cap[:, 0] > 0.0, 1.0, -1.0)
    square = np.maximum(distance * distance, radius * radius)
    leg = np.sqrt(square - radius * radius)
    square = np.maximum(square, _NO_DIRECTION)
    along = np.stack(
        [
            (side * leg * apart[:, 0] - radius * apart[:, 1]) / square,
            (radius * apart[:, 0] + side * leg * apart[:, 1]) / square,
        ],
        axis=1,
    )
    leg_normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    leg_change = -(leg_normal * relative).sum(axis=1)

    normal = np.where(on_cap[:, None], cap_normal, leg_normal)
    change = np.where(on_cap, cap_change, leg_change)
    bound = normal @ velocity + taken * change
    return np.column_stack([normal, bound])


def _unit(vectors: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return vectors (N, 2) scaled to length 1, or ``otherwise`` for those without direction."""
    length = np.hypot(vectors[:, 0], vectors[:, 1])[:, None]
    return np.where(length > _NO_DIRECTION, vectors / np.maximum(length, _NO_DIRECTION), otherwise)
