"""Steady-state values of a policy, for one standing person at an exactly known position."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from ._footprint import Footprint
from ._policy import AwarenessPolicy
from ._robot import RobotProfile, RobotState
from ._separation import max_speed_mps

# Halvings of a few metres, to the precision of a float.
_ROUNDS: Final = 60


def settled_radius_m(policy: AwarenessPolicy, awareness_lower: ArrayLike) -> FloatArray:
    """Return the obstacle radius at each lower bound of α, limited to floor and ceiling.

    With hysteresis the values are those of a rising α.
    """
    flat = np.asarray(awareness_lower, dtype=np.float64)
    radii = [policy.margins.bounded_m(policy.inflation.radius_m(a)) for a in flat.ravel().tolist()]
    return np.array(radii).reshape(flat.shape)


def settled_human_speed_mps(policy: AwarenessPolicy, awareness_lower: ArrayLike) -> FloatArray:
    """Return the assumed human speed at each lower bound of α."""
    flat = np.asarray(awareness_lower, dtype=np.float64)
    speeds = [policy.speed.human_speed_mps(a) for a in flat.ravel().tolist()]
    return np.array(speeds).reshape(flat.shape)


def settled_speed_limit_mps(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    separation_m: ArrayLike,
    awareness_lower: ArrayLike,
) -> FloatArray:
    """Return the speed limit for a person straight ahead, who stands and has been seen for long.

    Position and velocity are known exactly. The outline matters for ``rules.walking`` only.

    Args:
        policy: the policy.
        robot: the robot.
        separation_m: from the footprint to the body's surface; broadcasts with ``awareness_lower``.
        awareness_lower: lower bound of α.

    Returns:
        The smallest limit of all rules in m/s, as :class:`~nav_adapter.NavAdapter` gives it, in the
        broadcast shape. With ``delay_from_tracks`` the person has not moved: ``moved_m`` and
        ``moved_age_s`` of the track are 0, so that the delay is ``start_delay_s``.
    """
    separation = np.asarray(separation_m, dtype=np.float64)
    # Rules for people who turn count from the circle about the base: that gap is never larger.
    circle_gap_m = _ahead_m(robot, separation + BODY_RADIUS_M) - BODY_RADIUS_M
    circle_gap_m -= robot.circumscribed_radius_m

    def limit_mps(
        gap_m: FloatArray, human_mps: ArrayLike, clearance_m: float, a_h: float, delay_s: float
    ) -> FloatArray:
        return max_speed_mps(
            gap_m,
            human_mps,
            deceleration_mps2=robot.max_deceleration_mps2,
            reaction_time_s=robot.reaction_time_s,
            clearance_m=clearance_m,
            human_acceleration_mps2=a_h,
            start_delay_s=delay_s,
        )

    rules = policy.rules
    standing, walking, reserve = rules.standing, rules.walking, rules.start_reserve
    human_mps = settled_human_speed_mps(policy, awareness_lower)
    assumed = human_mps, policy.margins.separation_clearance_m
    if standing is None:
        limit = limit_mps(separation, *assumed, np.inf, 0.0)
    else:
        a_h, delay_s = standing.human_acceleration_mps2, standing.start_delay_s
        limit = limit_mps(separation, *assumed, a_h, delay_s)
    if walking is not None:
        a_h, delay_s = walking.human_acceleration_mps2, walking.turn_delay_s
        limit = np.maximum(limit, limit_mps(circle_gap_m, *assumed, a_h, delay_s))
    if reserve is not None:
        a_h, delay_s = reserve.human_acceleration_mps2, reserve.start_delay_s
        whoever = policy.speed.human_speed_mps(0.0), 0.0
        start_limit = limit_mps(separation, *whoever, a_h, delay_s)
        if walking is not None and walking.human_acceleration_mps2 <= a_h:
            turned = limit_mps(circle_gap_m, *whoever, a_h, min(delay_s, walking.turn_delay_s))
            start_limit = np.maximum(start_limit, turned)
        limit = np.minimum(limit, start_limit)
    if rules.zones is not None:
        limit = np.minimum(limit, rules.zones.limit_mps(separation, robot.max_speed_mps))
    if rules.near_cap is not None:
        limit = np.minimum(limit, rules.near_cap.limit_mps(separation, robot.max_deceleration_mps2))
    return np.minimum(limit, robot.max_speed_mps)


def _ahead_m(robot: RobotProfile, away_m: FloatArray) -> FloatArray:
    """Return how far ahead of the base a point is that lies ``away_m`` from the outline."""
    footprint, base = Footprint(robot.footprint_m), RobotState(0.0, np.zeros(2), 0.0, 0.0, 0.0)
    near_m, far_m = np.zeros_like(away_m), away_m + robot.circumscribed_radius_m
    for _ in range(_ROUNDS):
        middle_m = 0.5 * (near_m + far_m)
        points = np.stack([middle_m.ravel(), np.zeros(away_m.size)], axis=1)
        is_near = footprint.distance_m(points, base).reshape(away_m.shape) < away_m
        near_m, far_m = np.where(is_near, middle_m, near_m), np.where(is_near, far_m, middle_m)
    return near_m
