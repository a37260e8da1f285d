"""The log of one crossing: every control cycle as a frame, contacts, and figures of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from nav_adapter import NavConstraints, RobotProfile, RobotState
from nav_adapter.rigid import Motion
from perception import PersonObservation
from perception.arrays import FloatArray
from perception.short_repr import short_repr
from tracking import PersonTrack

from ..actors.behaviour import PersonOutcome
from ..actors.robot import NOVA_CARTER
from ..world.errors import SimError
from ._separations import NEAR_M, STANDING_SPEED_MPS, Approach, ContactEvent, contact_by
from ._stage import TrueView

#: Somebody who has looked at the robot within this time counts as looking.
LOOKING_WITHIN_S: Final = 1.0


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

    Its arrays hold N instants and P people. People who are away at an instant have NaN for place
    and velocity, and are infinitely far.

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
        time_without_people_s: time to goal of the same task without people; None if that run did
            not reach the goal or was not made.
        length_without_people_m: driven length of the same task without people.
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
    time_without_people_s: float | None = None
    length_without_people_m: float | None = None

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

    @property
    def contacts_by_robot(self) -> list[ContactEvent]:
        """Contacts that the robot caused."""
        return [each for each in self.contacts if each.by == "robot"]

    @property
    def moving_contacts(self) -> list[ContactEvent]:
        """Contacts with a moving robot, by any cause."""
        return [each for each in self.contacts if each.robot_speed_mps > STANDING_SPEED_MPS]

    @cached_property
    def t_s(self) -> FloatArray:
        """(N,) times, increasing."""
        return np.array([frame.t_s for frame in self.frames])

    @cached_property
    def _course(self) -> FloatArray:
        """(N, 6) motions of the robot."""
        return np.array([Motion.of(frame.robot_state) for frame in self.frames])

    @property
    def robot_odom_m(self) -> FloatArray:
        """(N, 2) positions of the base origin."""
        return self._course[:, :2]

    @property
    def heading_odom_rad(self) -> FloatArray:
        """(N,) headings of the robot."""
        return self._course[:, 2]

    @property
    def velocity_base_mps(self) -> FloatArray:
        """(N, 2) velocities of the base origin, forward and to the left."""
        return self._course[:, 3:5]

    @property
    def yaw_rate_radps(self) -> FloatArray:
        """(N,) yaw rates of the robot."""
        return self._course[:, 5]

    @property
    def travel_mps(self) -> FloatArray:
        """(N,) speeds of the base origin in its direction of travel, at least 0."""
        return np.asarray(np.hypot(*self.velocity_base_mps.T))

    @property
    def moves(self) -> NDArray[np.bool_]:
        """(N,) whether the robot moves: it drives, or turns on the spot."""
        return np.array([frame.robot_moves for frame in self.frames])

    @cached_property
    def _shape(self) -> tuple[int, int]:
        """N and P; raises SimError without frames, and with frames that do not hold all people."""
        if not self.frames:
            raise SimError("an episode without frames cannot be measured")
        people = len(self.frames[0].truth)
        if any({len(each.truth), len(each.approaches)} != {people} for each in self.frames):
            raise SimError(
                f"every frame must hold the truth and the separation of all {people} people"
            )
        return len(self.frames), people

    def _of_people(self, name: str, *size: int) -> FloatArray:
        """Return (N, P, ...) values of the truth."""
        shape = self._shape
        rows = [[getattr(view, name) for view in frame.truth] for frame in self.frames]
        return np.array(rows, dtype=np.float64).reshape(*shape, *size)

    @cached_property
    def people_odom_m(self) -> FloatArray:
        """(N, P, 2) positions of the people's centre lines."""
        return self._here * self._of_people("position_odom_m", 2)

    @property
    def people_heading_odom_rad(self) -> FloatArray:
        """(N, P) headings of the people's bodies."""
        return (self._here * self._of_people("heading_odom_rad", 1))[..., 0]

    @cached_property
    def people_odom_mps(self) -> FloatArray:
        """(N, P, 2) velocities of the people."""
        return self._here * self._of_people("velocity_odom_mps", 2)

    @property
    def _here(self) -> FloatArray:
        return np.where(self._of_people("away", 1), np.nan, 1.0)

    @cached_property
    def awareness(self) -> FloatArray:
        """(N, P) true α."""
        return self._of_people("awareness")

    @cached_property
    def could_look(self) -> NDArray[np.bool_]:
        """(N, P) whether the robot was in front of the person and in sight."""
        return self._of_people("could_look").astype(np.bool_)

    @cached_property
    def since_look_s(self) -> FloatArray:
        """(N, P) times since people last looked at the robot, infinite before."""
        return self._of_people("since_look_s")

    @cached_property
    def has_noticed(self) -> NDArray[np.bool_]:
        """(N, P) whether a look of theirs has taken the robot in."""
        return self._of_people("noticed").astype(np.bool_)

    @cached_property
    def separation_m(self) -> FloatArray:
        """(N, P) distances between the surfaces; lower bounds with centres more than 4 m apart."""
        return np.array([each.separations_m for each in self.frames]).reshape(self._shape)

    @property
    def nearest_m(self) -> FloatArray:
        """(N,) smallest separations; infinite without people."""
        return np.asarray(self.separation_m.min(axis=1, initial=np.inf))

    @property
    def anybody(self) -> bool:
        """True if somebody was there at some instant."""
        return bool(np.isfinite(self.separation_m).any())

    @cached_property
    def margins_m(self) -> FloatArray:
        """(N, P) separation margins."""
        return np.array([frame.margins_m for frame in self.frames]).reshape(self._shape)

    @cached_property
    def nearest_point_mps(self) -> FloatArray:
        """(N, P) speeds of the point of the robot that is nearest to each person."""
        rows = [[each.robot_speed_mps for each in frame.approaches] for frame in self.frames]
        return np.array(rows, dtype=np.float64).reshape(self._shape)

    @property
    def looks(self) -> NDArray[np.bool_]:
        """(N, P) whether people look at the robot."""
        return np.asarray(self.since_look_s <= 0.0)

    @property
    def looking(self) -> NDArray[np.bool_]:
        """(N, P) whether people look at the robot, or did within the last second."""
        return np.asarray(self.since_look_s <= LOOKING_WITHIN_S + 1e-9)

    @property
    def noticed(self) -> dict[str, NDArray[np.bool_]]:
        """People by what they have noticed of the robot, (N, P) each; everybody is in one.

        That is what they took in by the simulator, not the way in which a head faces.
        """
        has, looking = self.has_noticed, self.looking
        return {"never": ~has, "past": has & ~looking, "looking": has & looking}

    def to_base(self, vectors_odom: FloatArray) -> FloatArray:
        """Return (N, P, 2) vectors in the axes of the base frame at their instant."""
        cos = np.cos(self.heading_odom_rad)[:, None]
        sin = np.sin(self.heading_odom_rad)[:, None]
        x, y = vectors_odom[..., 0], vectors_odom[..., 1]
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)

    def time_with(self, condition: NDArray[np.bool_]) -> float:
        """Return the seconds during which a condition (N,) held.

        Each instant stands for the time to the next one.
        """
        return float(np.diff(self.t_s) @ condition[:-1].astype(np.float64))
