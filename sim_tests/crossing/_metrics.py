"""Safety figures of a crossing: separation, separation margin, and contacts with their cause."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final

from nav_adapter import RobotProfile, protective_separation_m
from perception.arrays import FloatArray

#: A robot at this speed or slower counts as standing (wheel motors never hold exactly zero).
STANDING_SPEED_MPS: Final = 0.03
#: C + Z of the separation margin, as in speed-and-separation monitoring (ISO 13855).
CLEARANCE_M: Final = 0.10
#: Distance to a person within which the robot's highest speed is reported.
NEAR_M: Final = 2.0


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """A contact of robot and person.

    Attributes:
        t_s: time at which it began.
        worker: number of the person.
        by: ``"robot"`` when the robot moved into the person, else ``"person"``.
        robot_speed_mps: speed of the robot at that time.
    """

    t_s: float
    worker: int
    by: str
    robot_speed_mps: float


@dataclass(slots=True)
class SafetyMeter:
    """The safety figures of one episode, accumulated.

    The separation margin is S − S_p: the distance between the surfaces of robot and person, minus
    the protective separation of ISO 13855 and ISO/TS 15066 for their true closing speeds. It counts
    while the robot moves. A standing robot has done what the standards ask: its margin is
    S − C − Z.

    Attributes:
        robot: limits of the robot.
        min_separation_m: smallest separation.
        min_margin_m: smallest margin while the robot moved.
        violation_time_s: time with a negative margin while the robot moved.
        max_speed_near_mps: highest speed of the robot within :data:`NEAR_M` of a person.
        contacts: all contacts.
        separations_m: separation of each person at the latest measurement.
    """

    robot: RobotProfile
    min_separation_m: float = float("inf")
    min_margin_m: float = float("inf")
    violation_time_s: float = 0.0
    max_speed_near_mps: float = 0.0
    contacts: list[ContactEvent] = field(default_factory=list)
    separations_m: list[float] = field(default_factory=list)
    _touching: set[int] = field(default_factory=set)

    def add_separation(
        self,
        separation_m: float,
        robot_velocity_mps: FloatArray,
        human_velocity_mps: FloatArray,
        towards_human: FloatArray,
        dt_s: float,
    ) -> float:
        """Add the separation of one person over one measurement; return the separation margin.

        Args:
            separation_m: distance between the surfaces, 0 when touching.
            robot_velocity_mps: (2,) in odom.
            human_velocity_mps: (2,) in odom.
            towards_human: (2,) unit vector from the robot to the person, in odom.
            dt_s: time since the last measurement.
        """
        speed = math.sqrt(robot_velocity_mps @ robot_velocity_mps)
        robot_closing = max(float(robot_velocity_mps @ towards_human), 0.0)
        human_closing = max(float(-(human_velocity_mps @ towards_human)), 0.0)
        moving = speed > STANDING_SPEED_MPS
        protective = CLEARANCE_M
        if moving:
            protective = float(
                protective_separation_m(
                    robot_closing,
                    human_closing,
                    deceleration_mps2=self.robot.max_deceleration_mps2,
                    reaction_time_s=self.robot.reaction_time_s,
                    clearance_m=CLEARANCE_M,
                )
            )
        margin = separation_m - protective
        self.separations_m.append(separation_m)
        self.min_separation_m = min(self.min_separation_m, separation_m)
        if moving:
            self.min_margin_m = min(self.min_margin_m, margin)
            if margin < 0.0:
                self.violation_time_s += dt_s
        if separation_m < NEAR_M:
            self.max_speed_near_mps = max(self.max_speed_near_mps, speed)
        return margin

    def touch(
        self,
        t_s: float,
        worker: int,
        robot_velocity_mps: FloatArray,
        towards_human: FloatArray,
    ) -> None:
        """Record that robot and person touch; a continuing touch is one contact."""
        if worker in self._touching:
            return
        self._touching.add(worker)
        closing = float(robot_velocity_mps @ towards_human)
        by = "robot" if closing > STANDING_SPEED_MPS else "person"
        self.contacts.append(
            ContactEvent(t_s, worker, by, math.sqrt(robot_velocity_mps @ robot_velocity_mps))
        )

    def release(self, worker: int) -> None:
        """Record that robot and person do not touch."""
        self._touching.discard(worker)
