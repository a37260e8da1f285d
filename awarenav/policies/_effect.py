"""The effect of a policy: radius, U and limit for one person who stands and has been seen."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray
from tracking import PersonTrack

#: How far the body's centre line is from the middle of the way, for a person beside the way.
BESIDE_M: Final = 1.2
_FAR_M: Final = 1000.0
# Long enough for every policy.
_FIRST_SIGHT_S: Final = 0.5

_Row = tuple[float, float, list[float], list[float]]


@dataclass(frozen=True, slots=True)
class Effect:
    """Effect of a policy, over lower bounds of α (A,) and distances (D,).

    Attributes:
        radius_m: (A,), of the obstacle.
        human_speed_mps: (A,), U, the speed that the person may change to.
        ahead_mps: (A, D), limit for a person straight ahead.
        beside_mps: (A, D), limit for a person beside the way, at the same distances along it.
    """

    radius_m: FloatArray
    human_speed_mps: FloatArray
    ahead_mps: FloatArray
    beside_mps: FloatArray


def effect_of(
    policy: AwarenessPolicy, robot: RobotProfile, awareness: FloatArray, distance_m: FloatArray
) -> Effect:
    """Return what the adapter gives for a robot that drives straight on.

    Place and velocity of the person are known exactly.

    Args:
        policy: of the adapter.
        robot: whose speed is limited.
        awareness: (A,), lower bounds of α.
        distance_m: (D,), from the robot's front to the person's body, along the way.
    """
    ahead_m = robot.footprint_m[:, 0].max() + BODY_RADIUS_M + distance_m
    rows: dict[tuple[float, float], _Row] = {}
    pairs = []
    for alpha in awareness.tolist():
        # Of two α with the same radius and U the adapter makes the same.
        pairs.append((policy.inflation.radius_m(alpha), policy.speed.human_speed_mps(alpha)))
        if pairs[-1] not in rows:
            rows[pairs[-1]] = _row(policy, robot, alpha, ahead_m.tolist())
    columns = zip(*(rows[pair] for pair in pairs), strict=True)
    radius, human, ahead, beside = (np.array(column) for column in columns)
    return Effect(radius, human, ahead, beside)


def _row(policy: AwarenessPolicy, robot: RobotProfile, alpha: float, ahead_m: list[float]) -> _Row:
    """Return radius, U and both rows of limits for one bound of α."""
    adapter, step_s = NavAdapter(policy, robot), policy.timing.fresh_within_s
    now = 0.0

    def seen_from(x_m: float, y_m: float) -> NavConstraints:
        """Return the constraints of a robot that is there; the person is at the origin."""
        nonlocal now
        now += step_s
        person = PersonTrack(
            *(1, now, "confirmed", np.zeros(2), np.zeros(2), np.zeros((4, 4))),
            *(alpha, 0.0, alpha, 1.75, 0.0),
        )
        state = RobotState(now, np.array([x_m, y_m]), 0.0, 0.5 * robot.max_speed_mps, 0.0)
        return adapter.update((person,), state, now)

    # Until frames have shown the person for long enough, and the circle shrinks no more.
    shrinking_s = (policy.inflation.radius_m(0.0) + 2.0) / policy.timing.shrink_rate_mps
    for _ in range(math.ceil((_FIRST_SIGHT_S + shrinking_s) / step_s) + 1):
        seen = seen_from(_FAR_M, 0.0)
    limits = [[seen_from(-x_m, -y_m).speed_limit_mps for x_m in ahead_m] for y_m in (0.0, BESIDE_M)]
    human_mps = float(policy.speed.human_speed_mps(alpha))
    return seen.obstacles[0].radius_m, human_mps, limits[0], limits[1]
