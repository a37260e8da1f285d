"""Starts of people who stand: by chance, as often as recorded people start."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from ._person import RobotBody

#: Share of people at the kerb who start within the next second, by the time since the last look at
#: the vehicle: now, up to 1 s, up to 4 s, and longer or never. The first row was counted at all
#: vehicles and stands for a robot that yields, the second at vehicles that move or accelerate.
START_SHARES: Final = {
    "yielding": (0.39, 0.45, 0.25, 0.13),
    "moving": (0.23, 0.26, 0.09, 0.10),
}
#: Ends of the first three times since the last look, s.
LOOK_WITHIN_S: Final = (0.0, 1.0, 4.0)
# People start only after they have stood for this long.
_STOOD_S: Final = 0.5
# The table counts starts in the second after a look was dated, so on average half a second later.
_HALF_SECOND_S: Final = 0.5
# A slower robot yields.
_YIELDING_MPS: Final = 0.25
# Robots farther away make nobody start.
_RANGE_M: Final = 12.0


def start_share(since_look_s: float, *, yielding: bool) -> float:
    """Return the share of people who start within a second.

    Args:
        since_look_s: time since the last look at the robot; infinite without one.
        yielding: the robot stands or creeps.
    """
    row = START_SHARES["yielding" if yielding else "moving"]
    late = sum(since_look_s > within + 1e-9 for within in LOOK_WITHIN_S)
    return row[late]


class StartingModel:
    """Decides when a person who stands starts to walk.

    Somebody who stands on the way, or waits for the robot, starts as people at the kerb do, see
    :data:`START_SHARES`. Somebody who has nowhere to go starts at a constant rate.

    Args:
        idle_share: share of people with nowhere to go who start within a second.
        rng: the person's own generator.
    """

    def __init__(self, idle_share: float, rng: np.random.Generator) -> None:
        self._idle_share, self._rng = idle_share, rng
        self._stands_since_s: float | None = None
        self._looked_s = -math.inf

    def starts(
        self,
        t_s: float,
        dt_s: float,
        *,
        standing: bool,
        idle: bool,
        looking: bool,
        place: tuple[float, float],
        robot: RobotBody | None,
    ) -> bool:
        """Return whether the person starts now.

        Args:
            t_s: now.
            dt_s: time since the last call.
            standing: the person stands.
            idle: the person has nowhere to go.
            looking: the person looks at the robot.
            place: x and y of the person.
            robot: the robot, whether the person knows it or not; None without one.
        """
        if looking:
            self._looked_s = t_s
        if not standing:
            self._stands_since_s = None
            return False
        if self._stands_since_s is None:
            self._stands_since_s = t_s
        if t_s - self._stands_since_s < _STOOD_S - 1e-9 or robot is None:
            return False
        if math.dist(place, (robot.x_m, robot.y_m)) > _RANGE_M:
            return False
        share = self._idle_share
        if not idle:
            yielding = math.hypot(robot.vx_mps, robot.vy_mps) < _YIELDING_MPS
            since_look_s = max(t_s - self._looked_s - _HALF_SECOND_S, 0.0)
            share = start_share(since_look_s, yielding=yielding)
        return bool(self._rng.random() < 1.0 - (1.0 - share) ** dt_s)
