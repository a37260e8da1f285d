"""Planners that fail in every way, for runs that must continue."""

from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path

import numpy as np

#: Environment variable with the path of a file that some planners make.
MARKER = "AWARENAV_TEST_MARKER"
#: Environment variable with the seconds that a planner sleeps in every cycle.
SLEEP_S = "AWARENAV_TEST_SLEEP_S"


class Slow:
    """Drives straight on at half a metre a second."""

    def __init__(self, robot):
        self.robot = robot

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.5, 0.0


class UsesGlobalRandom(Slow):
    """Draws from the global generators, as some planners do."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        numpy_draw = np.random.random()  # noqa: NPY002
        return 0.2 + 0.4 * random.random() + 0.4 * numpy_draw, 0.0


class Raises(Slow):
    """Raises an error in its first cycle."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        raise RuntimeError("no way\nfound, honestly")


class Dies(Slow):
    """Kills its process."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        os.kill(os.getpid(), signal.SIGKILL)


class DiesOnce(Slow):
    """Kills its process the first time."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        marker = Path(os.environ[MARKER])
        if not marker.exists():
            marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().plan(robot_state, goal_odom_m, constraints, dt_s)


class Hangs(Slow):
    """Never answers, and catches every error."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        try:
            time.sleep(3600.0)
        except Exception:  # what a careless planner may do
            return 0.0, 0.0


class Terminates(Slow):
    """Asks its process to end."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        os.kill(os.getpid(), signal.SIGTERM)
        return 0.0, 0.0


class Leaves(Slow):
    """Makes the marker."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        Path(os.environ[MARKER]).touch()
        return super().plan(robot_state, goal_odom_m, constraints, dt_s)


class Sleeps(Slow):
    """Sleeps in every cycle for as long as the environment says."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        time.sleep(float(os.environ.get(SLEEP_S, "0")))
        return super().plan(robot_state, goal_odom_m, constraints, dt_s)


class NoPlan:
    """Has no method ``plan``."""

    def __init__(self, robot):
        pass


def with_boxes(robot, static_boxes_odom_m):
    """Make a planner that knows the racks."""
    planner = Slow(robot)
    planner.boxes = static_boxes_odom_m
    return planner


NOT_CALLABLE = 3


def square(number):
    """Return the square; a negative number kills the process."""
    if number < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2
