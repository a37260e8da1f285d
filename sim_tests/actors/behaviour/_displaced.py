"""Recorded people who leave their path where the robot forces them off it, and then return."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ..body import Gait, OnlineFootsteps, skeleton
from ._avoidance import SlowRobotDetour, limit_approach
from ._obstacles import Obstacles
from ._person import PersonMotion, RobotBody, Surroundings
from ._replayed import Replayed, replayed_people
from ._route import DesiredVelocity
from ._social_force import RELAXATION_S, robot_force
from ._trajectory import MAX_ACCELERATION_MPS2, Trajectory, limited
from ._walker import DECISION_PERIOD_S

# A social force from here on moves a person off the recorded path.
_FORCED_OFF_MPS2: Final = 0.5
_STANDOFF_M: Final = 0.45
# A displaced person aims at the recorded place of the present time, and would reach it in this
# time; but is never faster than this, or than this factor times the recorded speed.
_RETURN_S: Final = 1.0
_DISPLACED_MPS: Final = 1.6
_DISPLACED_FACTOR: Final = 1.3
# The recording goes on from a place and a velocity this near to it.
_BACK_WITHIN_M: Final = 0.01
_BACK_WITHIN_MPS: Final = 0.05
# The body faces where it walks from this speed on, and turns at this rate.
_FACING_FROM_MPS: Final = 0.3
_TURN_RADPS: Final = 2.6
# Speed of the step back after a contact.
_RECOIL_MPS: Final = 0.4


class Displaced:
    """A person who follows a recording until the robot forces them off it.

    The recording is met exactly until the social force of the robot on it exceeds 0.5 m/s². From
    then on the person is pushed by that force, walks round a slow robot and never into one, and
    heads for the place where the recording has them at the present time. There the recording goes
    on. People know the robot from any side; they do not look at it.

    Args:
        recorded: the person as recorded.
        boxes_odom_m: (N, 4) racks and walls, x_min, y_min, x_max, y_max.

    Attributes:
        recorded: as given.
        displaced: the person is off the recorded path now.
        farthest_m: largest distance from the recorded place so far.
    """

    def __init__(self, recorded: Replayed, boxes_odom_m: FloatArray) -> None:
        self.recorded = recorded
        self._obstacles = Obstacles(boxes_odom_m)
        self._trajectory: Trajectory | None = None
        self._detour = SlowRobotDetour()
        self._tick = -1
        self._now_s = 0.0
        self._turned_rad = 0.0  # heading beyond the recorded one
        self._feet: OnlineFootsteps | None = None
        self._feet_s = 0.0
        self._walked_m = 0.0
        self._last: tuple[float, float, float] | None = None  # x, y and heading
        self._before_last: tuple[float, float, float] | None = None
        self.farthest_m = 0.0

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        return self.recorded.stature_m

    @property
    def look(self) -> str | None:
        """Name of a shipped worker."""
        return self.recorded.look

    @property
    def stride_m(self) -> float | None:
        """None: the stride follows the speed."""
        return None

    @property
    def displaced(self) -> bool:
        """True while the person is off the recorded path."""
        return self._trajectory is not None

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """Return the motion at ``t_s``, which never decreases."""
        while (self._tick + 1) * DECISION_PERIOD_S <= t_s + 1e-9:
            self._tick += 1
            self._decide(self._tick * DECISION_PERIOD_S, around)
        recorded = self.recorded.motion(t_s, around)
        dt_s, self._now_s = t_s - self._now_s, t_s
        if self.recorded.is_away(t_s):
            self._trajectory, self._feet, self._last = None, None, None
            return recorded
        x, y = recorded.position_odom_m.tolist()
        vx, vy = recorded.velocity_odom_mps.tolist()
        acceleration = (0.0, 0.0)
        if self._trajectory is not None:
            away_x, away_y = x, y
            x, y, vx, vy = self._trajectory.state(t_s)
            acceleration = self._trajectory.acceleration
            self.farthest_m = max(self.farthest_m, math.hypot(x - away_x, y - away_y))
        heading = self._heading(recorded, vx, vy, dt_s)
        before = self._last or (x, y, heading)
        self._before_last, self._last = before, (x, y, heading)
        self._walked_m += math.hypot(x - before[0], y - before[1])
        if self._feet is None:
            gait = Gait(skeleton(self.look, self.stature_m))
            self._feet, self._feet_s = OnlineFootsteps(gait, x, y, heading), t_s
        turning = math.remainder(heading - before[2], math.tau) / dt_s if dt_s > 0.0 else 0.0
        feet = self._feet.step(t_s - self._feet_s, (x, y, heading), (vx, vy, turning), acceleration)
        self._feet_s = t_s
        return replace(
            recorded,
            position_odom_m=np.array([x, y]),
            velocity_odom_mps=np.array([vx, vy]),
            heading_odom_rad=heading,
            walked_m=self._walked_m,
            feet=feet,
        )

    def hold(self) -> None:
        """Take the last motion back: it would have led into the robot, and the body stayed."""
        if self._before_last is None:
            return
        self._last = self._before_last
        x, y, _ = self._last
        self._start_segment((x, y, 0.0, 0.0), (0.0, 0.0))
        if self._feet is not None:
            self._feet.undo()

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Step back from the robot, which lies in this direction (a unit vector in odom)."""
        if self._last is None:
            return
        x, y, _ = self._last
        self._start_segment((x, y, -_RECOIL_MPS * towards_x, -_RECOIL_MPS * towards_y), (0.0, 0.0))

    def _start_segment(
        self, state: tuple[float, float, float, float], acceleration: tuple[float, float]
    ) -> None:
        """Move off the recorded path from ``state`` now until the next decision."""
        if self._trajectory is None:
            self._trajectory = Trajectory(state[0], state[1], self._obstacles)
        left_s = (self._tick + 1) * DECISION_PERIOD_S - self._now_s
        self._trajectory.start_segment(self._now_s, state, acceleration, left_s)

    def _decide(self, t_s: float, around: Surroundings) -> None:
        """Stay on the recording, leave it, or move towards it."""
        robot = around.robot
        if robot is None or self.recorded.is_away(t_s):
            self._trajectory = None
            return
        recorded = self.recorded.motion(t_s, around)
        x, y = recorded.position_odom_m.tolist()
        vx, vy = recorded.velocity_odom_mps.tolist()
        if self._trajectory is None:
            if math.hypot(*robot_force(x, y, vx, vy, robot)) < _FORCED_OFF_MPS2:
                return
            state = (x, y, vx, vy)
            self._trajectory = Trajectory(x, y, self._obstacles)
        else:
            state = self._trajectory.end
        forced = robot_force(*state, robot)
        if (
            math.hypot(*forced) < _FORCED_OFF_MPS2
            and math.hypot(x - state[0], y - state[1]) < _BACK_WITHIN_M
            and math.hypot(vx - state[2], vy - state[3]) < _BACK_WITHIN_MPS
        ):
            self._trajectory = None
            return
        wanted = self._back(state, (x, y, vx, vy), robot)
        ax, ay = (
            (wish - now) / RELAXATION_S + push
            for wish, now, push in zip(wanted, state[2:], forced, strict=True)
        )
        ax, ay = limited(ax, ay, MAX_ACCELERATION_MPS2)
        next_vx, next_vy = state[2] + ax * DECISION_PERIOD_S, state[3] + ay * DECISION_PERIOD_S
        fastest = _fastest_mps(math.hypot(vx, vy))
        share = min(fastest / max(math.hypot(next_vx, next_vy), 1e-9), 1.0)
        acceleration = (
            (share * next_vx - state[2]) / DECISION_PERIOD_S,
            (share * next_vy - state[3]) / DECISION_PERIOD_S,
        )
        self._trajectory.start_segment(t_s, state, acceleration, DECISION_PERIOD_S)

    def _back(
        self,
        state: tuple[float, float, float, float],
        recorded: tuple[float, float, float, float],
        robot: RobotBody,
    ) -> tuple[float, float]:
        """Return the velocity that leads back to the recording, around a slow robot."""
        wish_x = recorded[2] + (recorded[0] - state[0]) / _RETURN_S
        wish_y = recorded[3] + (recorded[1] - state[1]) / _RETURN_S
        wish = math.hypot(wish_x, wish_y)
        if wish < 1e-9:
            return 0.0, 0.0
        fastest = _fastest_mps(math.hypot(recorded[2], recorded[3]))
        desired = DesiredVelocity(wish_x / wish, wish_y / wish, min(wish, fastest))
        desired = self._detour.steer(desired, state[0], state[1], robot)
        desired = limit_approach(desired, state[0], state[1], robot, _STANDOFF_M)
        return desired.speed_mps * desired.ux, desired.speed_mps * desired.uy

    def _heading(self, recorded: PersonMotion, vx: float, vy: float, dt_s: float) -> float:
        """Return the recorded heading, turned to where a displaced body walks."""
        wanted = 0.0
        if self._trajectory is not None:
            wanted = self._turned_rad
            if math.hypot(vx, vy) >= _FACING_FROM_MPS:
                off = math.atan2(vy, vx) - recorded.heading_odom_rad
                wanted = math.remainder(off, math.tau)
        step = math.remainder(wanted - self._turned_rad, math.tau)
        most = _TURN_RADPS * dt_s
        self._turned_rad += min(max(step, -most), most)
        return recorded.heading_odom_rad + self._turned_rad


def _fastest_mps(recorded_mps: float) -> float:
    """Return the highest speed of a person off the path, who walks this fast on it."""
    return max(_DISPLACED_MPS, _DISPLACED_FACTOR * recorded_mps)


def displaced_people(
    path: str | Path, boxes_odom_m: FloatArray, *, leaves: bool = False
) -> tuple[Displaced, ...]:
    """Return the people of a table, whom the robot can force off their paths.

    Args:
        path: the table, see :func:`read_recordings`.
        boxes_odom_m: (N, 4) racks and walls.
        leaves: as for :class:`Replayed`.

    Raises:
        SimError: see :func:`read_recordings`.
    """
    people = replayed_people(path, leaves=leaves)
    return tuple(Displaced(recorded, boxes_odom_m) for recorded in people)
