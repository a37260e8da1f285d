"""Times and turns of the motions that the dynamic window compares, for each robot."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from nav_adapter import RobotProfile
from perception.arrays import FloatArray

#: Gap between footprint and obstacle that a braking robot must keep, in metres.
CLEARANCE_M: Final = 0.05
#: Distance at which the goal counts as reached and the robot stops.
GOAL_TOLERANCE_M: Final = 0.1
# Horizon of roll-outs and predictions of people, the longest one, the number of poses, and the time
# for which a candidate turns before it goes straight.
_HORIZON_S: Final = 3.0
_LONGEST_HORIZON_S: Final = 7.5
_POSES: Final = 15
_TURN_TIME_S: Final = 0.8
#: Largest yaw rate, and yaw acceleration, of a robot that has no lower ones.
YAW_RATE_RADPS: Final = 1.2
_YAW_ACCELERATION_RADPS2: Final = 3.0


class Sampling(NamedTuple):
    """Times and turns of a robot's candidates.

    Attributes:
        horizon_s: of roll-outs, and of predictions of people; at least twice the time to stop.
        turn_time_s: time for which a candidate turns before it goes straight.
        yaw_rate_radps: largest yaw rate.
        yaw_acceleration_radps2: largest change of it.
    """

    horizon_s: float
    turn_time_s: float
    yaw_rate_radps: float
    yaw_acceleration_radps2: float

    @classmethod
    def of(cls, robot: RobotProfile) -> Sampling:
        """Return those of ``robot``."""
        yaw_rate = min(YAW_RATE_RADPS, robot.max_yaw_rate_radps or math.inf)
        acceleration = min(_YAW_ACCELERATION_RADPS2, robot.max_yaw_acceleration_radps2 or math.inf)
        stop_s = robot.max_speed_mps / robot.max_deceleration_mps2
        longer = min(max(2.0 * stop_s / _HORIZON_S, 1.0), _LONGEST_HORIZON_S / _HORIZON_S)
        return cls(_HORIZON_S * longer, _TURN_TIME_S * longer, yaw_rate, acceleration)

    @property
    def times_s(self) -> FloatArray:
        """Times (T, 1, 1) of the poses of a roll-out."""
        return along_time(self.horizon_s / _POSES, self.horizon_s, _POSES)


def along_time(first: float, last: float, samples: int) -> FloatArray:
    """Return (T, 1, 1) numbers from ``first`` to ``last``."""
    return np.linspace(first, last, samples, dtype=np.float64)[:, None, None]
