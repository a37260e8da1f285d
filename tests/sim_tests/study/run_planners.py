"""Planners that fail in every way, for runs that must continue."""

from __future__ import annotations

import math
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


class Straight:
    """Drives straight on, at the speed limit and at most at ``speed_mps``, and stops."""

    def __init__(self, robot, speed_mps=0.6):
        self.speed_mps = speed_mps

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        left_m = math.dist(robot_state.position_odom_m, goal_odom_m) - 0.1
        stopping_mps = math.sqrt(max(left_m, 0.0))
        return min(self.speed_mps, stopping_mps, constraints.speed_limit_mps), 0.0


class ReturnsNothing(Slow):
    """Returns a number that is none."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return math.nan, 0.0


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


class Counted(Slow):
    """Adds a line to the marker when it is made."""

    def __init__(self, robot):
        super().__init__(robot)
        with Path(os.environ[MARKER]).open("a") as file:
            file.write("made\n")


class Counted(Slow):
    """Adds a line to the marker when it is made."""

    def __init__(self, robot):
        super().__init__(robot)
        with Path(os.environ[MARKER]).open("a") as file:
            file.write("made\n")


class Counted(Slow):
    """Adds a line to the marker when it is made."""

    def __init__(self, robot):
        super().__init__(robot)
        with Path(os.environ[MARKER]).open("a") as file:
            file.write("made\n")


class Sleeps(Slow):
    """Sleeps in every cycle for as long as the environment says."""

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        time.sleep(float(os.environ.get(SLEEP_S, "0")))
        return super().plan(robot_state, goal_odom_m, constraints, dt_s)


class NoPlan:
    """Has no method ``plan``."""

    def __init__(self, robot):
        pass


class Given:
    """Keeps the arguments that it was made with, and stands."""

    def __init__(self, *given):
        self.given = given

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.0, 0.0


class Init(Given):
    def __init__(self):
        super().__init__()


class Robot(Given):
    def __init__(self, robot):
        super().__init__(robot)


class AnyName(Given):
    def __init__(self, vehicle, /, gain=2.0):
        super().__init__(vehicle, gain)


class Seed(Given):
    def __init__(self, *, seed):
        super().__init__(seed)


class Everything(Given):
    def __init__(self, seed, static_boxes_odom_m, profile, **options):
        super().__init__(seed, static_boxes_odom_m, profile, options)


class Follows(Given):
    def __init__(self, robot, *, reference_path_odom_m):
        super().__init__(reference_path_odom_m)


class PositionalOnly(Given):
    def __init__(self, gain=2.0, seed=5, /):
        super().__init__(gain, seed)


class Asks(Given):
    def __init__(self, robot, costmap):
        super().__init__(robot, costmap)


class Breaks(Given):
    def __init__(self):
        raise RuntimeError("no licence")


def function(seed=None):
    return Given(seed)


NOT_CALLABLE = 3


def square(number):
    """Return the square; a negative number kills the process."""
    if number < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


#: A planner that is made already.
READY = Straight(None, 0.5)
