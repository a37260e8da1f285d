"""Planners for comparisons: one of each conduct."""

from __future__ import annotations

import math
import time


class Straight:
    """Drives straight on, at the speed limit and at most at ``speed_mps``, and stops."""

    def __init__(self, robot, speed_mps=0.6):
        self.speed_mps = speed_mps

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        left_m = math.dist(robot_state.position_odom_m, goal_odom_m) - 0.1
        stopping_mps = math.sqrt(max(left_m, 0.0))
        return min(self.speed_mps, stopping_mps, constraints.speed_limit_mps), 0.0


class Raises(Straight):
    """Raises an error in its first cycle."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        raise RuntimeError("no way found")


class ReturnsNothing(Straight):
    """Returns a number that is none."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return math.nan, 0.0


class Hangs(Straight):
    """Never answers."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        time.sleep(3600.0)


#: A planner that is made already.
READY = Straight(None, 0.5)
