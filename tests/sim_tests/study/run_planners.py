"""Planners that go wrong in every way, for runs that must go on."""

from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path

import numpy as np

#: Environment variable: a file that the process that dies once leaves behind.
MARKER = "AWARENAV_TEST_MARKER"


class Slow:
    """Drives straight on at half a metre a second."""

    def __init__(self, robot):
        self.robot = robot

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.5, 0.0


class Chancy(Slow):
    """Draws from the global generators, as some planners do."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        theirs = np.random.random()  # noqa: NPY002
        return 0.2 + 0.4 * random.random() + 0.4 * theirs, 0.0


class Raises(Slow):
    """Gives up in its first cycle."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        raise RuntimeError("no way\nfound, honestly")


class Dies(Slow):
    """Takes its process along."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        os.kill(os.getpid(), signal.SIGKILL)


class DiesOnce(Slow):
    """Takes its process along the first time."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        marker = Path(os.environ[MARKER])
        if not marker.exists():
            marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().plan(robot_state, goal_odom_m, constraints, dt_s)


class Hangs(Slow):
    """Never answers."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        time.sleep(3600.0)


class NoPlan:
    """Cannot plan."""

    def __init__(self, robot):
        pass


def with_boxes(robot, static_boxes_odom_m):
    """A function that makes a planner, and sees the racks."""
    planner = Slow(robot)
    planner.boxes = static_boxes_odom_m
    return planner


NOT_CALLABLE = 3
