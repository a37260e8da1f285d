"""Today's AMR with the two fields that vehicles have: one stops the robot, the other slows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from tracking import PersonTrack

#: Name of the policy ``scanner`` with these fields.
SCANNER_WARNING: Final = "scanner_warning"
#: A stopped robot starts again once its protective field has been clear for so long.
RESTART_S: Final = 2.0
#: Share of its maximum that a robot drives with somebody in its warning field.
SLOW_SHARE: Final = 0.3
# Overshoot of wheel motors at the end of a ramp: no sign of a field that is too short.
_OVERSHOOT_MPS: Final = 0.03


class FieldsAdapter:
    """The adapter of an AMR whose scanners have a protective field and a warning field.

    Both are those of the policy ``scanner``: a field for a speed is free if that policy allows this
    speed. The *protective field* is the one for the robot's speed, or for its slow speed if it is
    slower. Manuals of safety scanners size it so: the way in which the vehicle reacts and brakes,
    from its own speed alone, with other fields for other speeds (SICK S300, operating instructions
    8010948, section "Mobile applications"). Somebody in it stops the robot until it has been clear
    for 2 s; that delay is chosen, no source gives it.

    The *warning field* is the one for full speed and twice the reaction time. So a robot that slows
    for somebody who stands has done so before they are in its protective field. With somebody in
    it, the robot drives at 0.3 of its maximum, as with the slowdown zone in the parameters that
    Nav2 ships. A warning field is no safety function (SICK S3000, operating instructions).

    Args:
        policy: ``scanner``, or another.
        robot: its profile.
    """

    def __init__(self, policy: AwarenessPolicy, robot: RobotProfile) -> None:
        late = replace(robot, reaction_time_s=2.0 * robot.reaction_time_s)
        self._robot = robot
        self._protective, self._warning = NavAdapter(policy, robot), NavAdapter(policy, late)
        self._intruded_s = -math.inf

    def update(
        self, tracks: Sequence[PersonTrack], robot_state: RobotState, stamp_s: float, **seen: Any
    ) -> NavConstraints:
        """Return the constraints at ``stamp_s``; as :meth:`NavAdapter.update`."""
        given = tracks, robot_state, stamp_s
        free = self._protective.update(*given, **seen)
        warned = self._warning.update(*given, **seen)
        slow_mps = SLOW_SHARE * self._robot.max_speed_mps
        if free.speed_limit_mps < max(robot_state.travel_mps - _OVERSHOOT_MPS, slow_mps):
            self._intruded_s = stamp_s
        if stamp_s - self._intruded_s < RESTART_S:
            return _at_most(free, 0.0, "protective field")
        if warned.speed_limit_mps < self._robot.max_speed_mps:
            return _at_most(free, slow_mps, "warning field")
        return free


def _at_most(constraints: NavConstraints, limit_mps: float, limited_by: str) -> NavConstraints:
    """Return constraints with another limit, if that is lower."""
    if constraints.speed_limit_mps <= limit_mps:
        return constraints
    return replace(
        constraints,
        speed_limit_mps=limit_mps,
        limited_by=limited_by,
        fastest_point_limit_mps=limit_mps,
        other_way_limit_mps=min(constraints.other_way_limit_mps, limit_mps),
    )
