"""The log of one crossing: every control cycle as a frame, contacts, and figures of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception import PersonObservation
from perception.arrays import FloatArray
from perception.short_repr import short_repr
from tracking import PersonTrack

from ..actors.behaviour import PersonOutcome
from ..actors.robot import NOVA_CARTER
from ._separations import NEAR_M, Approach, ContactEvent, contact_by
from ._stage import TrueView


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CrossingFrame:
    """One control cycle: truth, perception, constraints and command.

    Attributes:
        t_s: simulated time.
        robot_state: true state of the robot.
        known_state: the robot's own state, as it knows it.
        T_odom_camera: (4, 4) true pose of the camera.
        truth: the truth about each person.
        observations: observations of the newest image that arrived in this cycle.
        observed_workers: ``observed_workers[i]`` is the worker that ``observations[i]`` shows, −1
            for none.
        tracks: tracks of the people.
        constraints: constraints from the adapter; for a stack outside, those that it is told.
        approaches: robot and person where they are nearest, for each person.
        margins_m: separation margin S − S_p of each person, see :func:`margins_m`.
        robot_moves: whether a point of the robot moves: it drives, or turns on the spot.
        at_goal: the robot stands at its goal.
        command: commanded speed (m/s) and yaw rate (rad/s); 0 before there is one.
        scan_points_odom_m: (N, 2) points of the scans that arrived in this cycle, as the robot
            places them.
        plan_s: processor time of this process in the planner's ``plan``, seconds: the load of the
            computer changes it little. Waiting for another process does not count. It is the only
            field that differs when the same episode is run again.
        lateral_command_mps: commanded speed to the left, of a robot that can move sideways.
        late_s: how much later than its time the cycle began, seconds on the clock of the computer;
            None but for a planner that drives in real time.
    """

    t_s: float
    robot_state: RobotState
    known_state: RobotState
    T_odom_camera: FloatArray
    truth: tuple[TrueView, ...]
    observations: tuple[PersonObservation, ...]
    observed_workers: tuple[int, ...]
    tracks: tuple[PersonTrack, ...]
    constraints: NavConstraints
    approaches: tuple[Approach, ...]
    margins_m: tuple[float, ...]
    robot_moves: bool
    at_goal: bool = False
    command: tuple[float, float] = (0.0, 0.0)
    scan_points_odom_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    plan_s: float = 0.0
    lateral_command_mps: float = 0.0
    late_s: float | None = None

    __repr__ = short_repr

    @property
    def separations_m(self) -> tuple[float, ...]:
        """Distance between the surfaces of each person and the robot.

        It is a lower bound with centres more than 4 m apart, and infinite for people who are away.
        """
        return tuple(each.separation_m for each in self.approaches)

    @property
    def margin_m(self) -> float:
        """Smallest margin to anybody at a moving robot; infinite at one that stands."""
        return min(self.margins_m, default=math.inf) if self.robot_moves else math.inf

    def observation_of(self, worker: int) -> PersonObservation | None:
        """Return the observation of a worker in this frame, or None."""
        for observation, index in zip(self.observations, self.observed_workers, strict=True):
            if index == worker:
                return observation
        return None


@dataclass(frozen=True, eq=False, repr=False)
class CrossingResult:
    """The log of one crossing; every figure is computed from it.

    Attributes:
        scenario: name of the scenario.
        seed: seed of the episode.
        policy: name of the policy.
        planner: name of the planner's class.
        perception: ``"truth"``, ``"keypoints"``, ``"pixels"``, ``"keypoints+scanner"``,
            ``"pixels+scanner"``, ``"scanner"`` or ``"oracle"``.
        contacts: all contacts of the robot and a person.
        time_to_goal_s: None when the goal was not reached.
        frames: one per control cycle.
        people: outcomes of the people of the scenario, who come first in lists of all people;
            replayed people come after them.
        robot: the robot.
        obstacle_boxes_odom_m: (B, 4) x_min, y_min, x_max, y_max of racks, walls and props.
        bumps: number of contacts of the robot with them.
    """

    scenario: str
    seed: int
    policy: str
    planner: str
    perception: str
    contacts: tuple[ContactEvent, ...]
    time_to_goal_s: float | None
    frames: tuple[CrossingFrame, ...]
    people: tuple[PersonOutcome, ...] = ()
    robot: RobotProfile = NOVA_CARTER
    obstacle_boxes_odom_m: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    bumps: int = 0

    def __repr__(self) -> str:
        """Return the fields and the main figures, with long values described."""
        return short_repr(self, "success", "contact_by", "min_separation_m", "min_margin_m")

    @property
    def success(self) -> bool:
        """True if the goal was reached, and the robot ran into nobody, no rack and no wall."""
        return self.time_to_goal_s is not None and self.contact_by != "robot" and not self.bumps

    @property
    def contact(self) -> bool:
        """True if robot and a person touched, whether the robot moved or stood."""
        return bool(self.contacts)

    @property
    def contact_by(self) -> Literal["", "robot", "person"]:
        """``"robot"`` if the robot moved into a person in any contact, else ``"person"``.

        Empty without a contact.
        """
        return contact_by(self.contacts)

    @property
    def duration_s(self) -> float:
        """Simulated time."""
        return self.frames[-1].t_s

    @property
    def min_separation_m(self) -> float:
        """Smallest distance between the surfaces of robot and person; infinite without people."""
        each_m = (away_m for frame in self.frames for away_m in frame.separations_m)
        return min(each_m, default=math.inf)

    @property
    def min_margin_m(self) -> float:
        """Smallest separation margin S − S_p while the robot moved."""
        return min((frame.margin_m for frame in self.frames), default=math.inf)

    @property
    def violation_time_s(self) -> float:
        """Time with a negative margin to anybody while the robot moved."""
        lasts_s = self.frames[1].t_s - self.frames[0].t_s if len(self.frames) > 1 else 0.0
        return lasts_s * sum(frame.margin_m < 0.0 for frame in self.frames)

    @property
    def max_speed_within_2m_mps(self) -> float:
        """Highest speed of the robot's nearest point to a person whose surface is within 2 m."""
        speeds_mps = (
            each.robot_speed_mps
            for frame in self.frames
            for each in frame.approaches
            if each.separation_m < NEAR_M
        )
        return max(speeds_mps, default=0.0)
