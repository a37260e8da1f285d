"""A planner that fails, named on the command line by its module."""

from __future__ import annotations


class Raises:
    """Fails in its first cycle."""

    def __init__(self, robot):
        self.robot = robot

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        raise RuntimeError("no way\nfound")
