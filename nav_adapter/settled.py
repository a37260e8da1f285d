"""Steady-state values of a policy, for one standing person at an exactly known position."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from perception.arrays import FloatArray

from ._policy import AwarenessPolicy
from ._robot import RobotProfile
from ._separation import max_speed_mps


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

    Args:
        policy: the policy.
        robot: the robot.
        separation_m: from the footprint to the body's surface; broadcasts with ``awareness_lower``.
        awareness_lower: lower bound of α.

    Returns:
        The smallest limit of all rules in m/s, as :class:`~nav_adapter.NavAdapter` gives it, in the
        broadcast shape. With ``delay_from_tracks`` it is the limit at the least delay.
    """
    separation = np.asarray(separation_m, dtype=np.float64)
    standing = policy.rules.standing
    limit = max_speed_mps(
        separation,
        settled_human_speed_mps(policy, awareness_lower),
        deceleration_mps2=robot.max_deceleration_mps2,
        reaction_time_s=robot.reaction_time_s,
        clearance_m=policy.margins.separation_clearance_m,
        human_acceleration_mps2=np.inf if standing is None else standing.human_acceleration_mps2,
        start_delay_s=0.0 if standing is None else standing.start_delay_s,
    )
    rules = policy.rules
    if rules.zones is not None:
        limit = np.minimum(limit, rules.zones.limit_mps(separation, robot.max_speed_mps))
    if rules.near_cap is not None:
        limit = np.minimum(limit, rules.near_cap.limit_mps(separation, robot.max_deceleration_mps2))
    return np.minimum(limit, robot.max_speed_mps)
