"""The end of a wait that nothing calls for: a robot stands beside people though it might drive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from nav_adapter import RobotState

# The robot goes on once it has stood for this time although it might drive this fast, and goes on
# for that time.
_STOOD_S: Final = 3.0
_FAST_ENOUGH_MPS: Final = 0.2
_GOES_ON_S: Final = 3.0
# A faster robot has not come to a stop yet.
_STANDING_MPS: Final = 0.03


class Waiting:
    """Decides when a robot that stands goes on with less room than it would like.

    Room compares yaw rates at equal speed, but maybe no curve that has it leads to a goal beside
    people who stand. Standing then costs least, for ever. Neither the limit nor the discs of people
    call for it, and both still hold when the robot goes on.
    """

    def __init__(self) -> None:
        self._stood_s = 0.0
        self._left_s = 0.0

    def goes_on(
        self, state: RobotState, command: Sequence[float], top_mps: float, dt_s: float
    ) -> bool:
        """Return whether the robot should go on now; it is asked once per tick.

        Args:
            state: of the robot.
            command: of the tick, as the planner returns it.
            top_mps: speed that limit, goal and giving way allow.
            dt_s: time for which the command is held.
        """
        self._left_s = max(self._left_s - dt_s, 0.0)
        stands = max(state.travel_mps, abs(command[0])) <= _STANDING_MPS
        self._stood_s = self._stood_s + dt_s if stands and top_mps >= _FAST_ENOUGH_MPS else 0.0
        if self._stood_s >= _STOOD_S:
            self._stood_s, self._left_s = 0.0, _GOES_ON_S
        return self._left_s > 0.0
