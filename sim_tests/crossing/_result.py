"""The result of one crossing: its figures, and every control cycle as a frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nav_adapter import NavConstraints, RobotProfile, RobotState
from perception import PersonObservation
from perception.arrays import FloatArray
from perception.short_repr import short_repr
from tracking import PersonTrack

from ..actors.behaviour import PersonOutcome
from ..actors.robot import NOVA_CARTER
from ._metrics import ContactEvent
from ._stage import TrueView


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CrossingFrame:
    """One control cycle: truth, perception, constraints and command.

    Attributes:
        t_s: simulated time.
        robot_state: true state of the robot.
        T_odom_camera: (4, 4) true pose of the camera.
        truth: the truth about each person.
        observations: observations of the newest image that arrived in this cycle.
        observed_workers: ``observed_workers[i]`` is the worker that ``observations[i]`` shows, −1
            for none.
        tracks: tracks of the people.
        constraints: constraints from the adapter.
        command: commanded speed (m/s) and yaw rate (rad/s).
        margins_m: separation margin of each person, as last measured, which is in every frame up to
            20 a second.
        separations_m: distance between the surfaces of each person and the robot, measured at the
            same time; a lower bound with centres more than 4 m apart.
        scan_points_odom_m: (N, 2) points of the scans that arrived in this cycle, as the robot
            places them.
        plan_s: elapsed time of the planner's ``plan``, seconds by the clock of the computer. It is
            the only field that differs when the same episode is run again.
        lateral_command_mps: commanded speed to the left, of a robot that can move sideways.
    """

    t_s: float
    robot_state: RobotState
    T_odom_camera: FloatArray
    truth: tuple[TrueView, ...]
    observations: tuple[PersonObservation, ...]
    observed_workers: tuple[int, ...]
    tracks: tuple[PersonTrack, ...]
    constraints: NavConstraints
    command: tuple[float, float]
    margins_m: tuple[float, ...]
    separations_m: tuple[float, ...] = ()
    scan_points_odom_m: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    plan_s: float = 0.0
    lateral_command_mps: float = 0.0

    __repr__ = short_repr

    def observation_of(self, worker: int) -> PersonObservation | None:
        """Return the observation of a worker in this frame, or None."""
        for observation, index in zip(self.observations, self.observed_workers, strict=True):
            if index == worker:
                return observation
        return None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CrossingResult:
    """The outcome of one crossing.

    Attributes:
        scenario: name of the scenario.
        seed: seed of the episode.
        policy: name of the policy.
        planner: name of the planner's class.
        perception: ``"truth"``, ``"keypoints"``, ``"pixels"``, ``"keypoints+scanner"``,
            ``"pixels+scanner"``, ``"scanner"`` or ``"oracle"``.
        success: the goal was reached, and the robot hit nobody by its own motion.
        contact: robot and a person touched, whether the robot moved or stood: ``contacts`` has its
            speed.
        contact_by: ``"robot"`` if the robot moved into a person in any contact, ``"person"`` if
            only people walked into the robot, else empty.
        contacts: all contacts.
        min_separation_m: smallest distance between the surfaces of robot and person.
        time_to_goal_s: None when the goal was not reached.
        max_speed_within_2m_mps: highest speed of the robot with a person's surface within 2 m.
        min_margin_m: smallest separation margin S − S_p while the robot moved.
        violation_time_s: time with a negative margin while the robot moved.
        duration_s: simulated time.
        frames: one per control cycle.
        people: outcomes of the people of the scenario, who come first in lists of all people;
            replayed people come after them.
        robot: the robot.
        obstacle_boxes_odom_m: (B, 4) x_min, y_min, x_max, y_max of racks, walls and props.
    """

    scenario: str
    seed: int
    policy: str
    planner: str
    perception: str
    success: bool
    contact: bool
    contact_by: str
    contacts: tuple[ContactEvent, ...]
    min_separation_m: float
    time_to_goal_s: float | None
    max_speed_within_2m_mps: float
    min_margin_m: float
    violation_time_s: float
    duration_s: float
    frames: tuple[CrossingFrame, ...]
    people: tuple[PersonOutcome, ...] = ()
    robot: RobotProfile = NOVA_CARTER
    obstacle_boxes_odom_m: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))

    __repr__ = short_repr
