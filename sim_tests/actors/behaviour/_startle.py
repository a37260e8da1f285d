"""Somebody who startles at a request: stops, steps aside, or steps into the robot's path."""

from __future__ import annotations

import math
from typing import Final

from ._hearing import StartleKind
from ._person import RobotBody
from ._reactions import left_of_line_m, robot_line
from ._route import DesiredVelocity
from ._social_force import RELAXATION_S

_LASTS_S: Final = 1.0
_ASIDE_MPS: Final = 0.7
# A step into the path; with the usual relaxation it covers 0.7 m in its time.
_INTO_PATH_MPS: Final = 1.3


class Startle:
    """One startle, which lasts a second.

    Args:
        kind: what the person does.
        from_s: time of its start.
    """

    def __init__(self, kind: StartleKind, from_s: float) -> None:
        self._kind, self._from_s = kind, from_s
        self._velocity: DesiredVelocity | None = None

    def is_over(self, t_s: float) -> bool:
        """Return whether the startle has ended."""
        return t_s >= self._from_s + _LASTS_S - 1e-9

    def velocity(
        self, t_s: float, place: tuple[float, float], robot: RobotBody
    ) -> DesiredVelocity | None:
        """Return the desired velocity; None before the start and after the end.

        The step leads straight away from the line of the robot's course, or towards it and not past
        it. Its direction stays that of the start.

        Args:
            t_s: now.
            place: x, y of the person.
            robot: the robot now.
        """
        if t_s < self._from_s or self.is_over(t_s):
            return None
        if self._velocity is None:
            ux, uy = line = robot_line(robot)
            side_m = left_of_line_m(place, robot, line)
            out = math.copysign(1.0, side_m)
            speed_mps = {"stop": 0.0, "aside": _ASIDE_MPS, "into_path": _INTO_PATH_MPS}[self._kind]
            if self._kind == "into_path":
                speed_mps, out = min(speed_mps, abs(side_m) / RELAXATION_S), -out
            self._velocity = DesiredVelocity(-out * uy, out * ux, speed_mps)
        return self._velocity
