"""Separations and contacts of robot and people as observed, and the safety figures of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

from nav_adapter import RobotProfile, protective_separation_m
from perception.arrays import FloatArray

#: A robot at this speed or slower counts as standing (wheel motors never hold exactly zero).
STANDING_SPEED_MPS: Final = 0.03
#: C + Z of the separation margin, as in speed-and-separation monitoring (ISO 13855).
CLEARANCE_M: Final = 0.10
#: Distance to a person within which the robot's highest speed is reported.
NEAR_M: Final = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class ContactEvent:
    """A contact of robot and person, as observed when it began.

    Attributes:
        t_s: time at which it began.
        worker: number of the person.
        robot_velocity_odom_mps: (2,) velocity of the robot; 0 if its wheels stood.
        towards_person: (2,) unit vector from the robot to the person, in odom.
    """

    t_s: float
    worker: int
    robot_velocity_odom_mps: FloatArray
    towards_person: FloatArray

    @property
    def by(self) -> Literal["robot", "person"]:
        """``"robot"`` if the robot moved into the person, else ``"person"``."""
        closing_mps = float(self.robot_velocity_odom_mps @ self.towards_person)
        return "robot" if closing_mps > STANDING_SPEED_MPS else "person"

    @property
    def robot_speed_mps(self) -> float:
        """Speed of the robot."""
        return _length(self.robot_velocity_odom_mps)


def contact_by(contacts: Iterable[ContactEvent]) -> Literal["", "robot", "person"]:
    """Return ``"robot"`` if the robot caused a contact, else ``"person"``; empty for none."""
    causes = {contact.by for contact in contacts}
    return "robot" if "robot" in causes else "person" if causes else ""


@dataclass(frozen=True, eq=False)
class Separations:
    """The separations of all people from the robot, as observed at one instant.

    The margin S − S_p is the distance between the surfaces of robot and person, minus the
    protective separation of ISO 13855 and ISO/TS 15066 for their true closing speeds. A standing
    robot has done what the standards ask: its margin is S − C − Z.

    Attributes:
        t_s: time of the observation.
        lasts_s: time to the next observation.
        robot: limits of the robot.
        robot_velocity_odom_mps: (2,).
        people_velocities_odom_mps: (2,) for each person.
        separations_m: distance between the surfaces of each person and the robot, 0 when touching.
        towards_people: (2,) unit vector from the robot to each person, in odom.
    """

    t_s: float
    lasts_s: float
    robot: RobotProfile
    robot_velocity_odom_mps: FloatArray
    people_velocities_odom_mps: tuple[FloatArray, ...]
    separations_m: tuple[float, ...]
    towards_people: tuple[FloatArray, ...]

    @cached_property
    def robot_speed_mps(self) -> float:
        """Speed of the robot."""
        return _length(self.robot_velocity_odom_mps)

    @property
    def robot_moves(self) -> bool:
        """True if the robot does not stand."""
        return self.robot_speed_mps > STANDING_SPEED_MPS

    @cached_property
    def margins_m(self) -> tuple[float, ...]:
        """Separation margin of each person."""
        if not self.robot_moves:
            return tuple(each - CLEARANCE_M for each in self.separations_m)
        return tuple(
            separation_m
            - float(
                protective_separation_m(
                    max(float(self.robot_velocity_odom_mps @ towards), 0.0),
                    max(float(-(velocity @ towards)), 0.0),
                    deceleration_mps2=self.robot.max_deceleration_mps2,
                    reaction_time_s=self.robot.reaction_time_s,
                    clearance_m=CLEARANCE_M,
                )
            )
            for separation_m, towards, velocity in zip(
                self.separations_m,
                self.towards_people,
                self.people_velocities_odom_mps,
                strict=True,
            )
        )


@dataclass(frozen=True, slots=True)
class SafetyFigures:
    """The safety figures of an episode, or of its beginning.

    Attributes:
        min_separation_m: smallest separation; infinite without people.
        min_margin_m: smallest margin while the robot moved.
        violation_time_s: time with a negative margin while the robot moved, added over the people.
        max_speed_within_2m_mps: highest speed of the robot with a person's surface within 2 m.
    """

    min_separation_m: float = math.inf
    min_margin_m: float = math.inf
    violation_time_s: float = 0.0
    max_speed_within_2m_mps: float = 0.0

    def after(self, t_s: float, now: Separations) -> SafetyFigures:
        """Return the figures after one more control cycle.

        Args:
            t_s: time of the cycle.
            now: the separations as last observed; those of an earlier cycle add nothing.
        """
        if now.t_s < t_s:
            return self
        nearest_m = min(now.separations_m, default=math.inf)
        margin_m, violation_s, near_mps = self.min_margin_m, self.violation_time_s, 0.0
        if now.robot_moves:
            margin_m = min((margin_m, *now.margins_m))
            for each in now.margins_m:
                violation_s += now.lasts_s if each < 0.0 else 0.0
        if nearest_m < NEAR_M:
            near_mps = now.robot_speed_mps
        return SafetyFigures(
            min(self.min_separation_m, nearest_m),
            margin_m,
            violation_s,
            max(self.max_speed_within_2m_mps, near_mps),
        )


def _length(vector: FloatArray) -> float:
    """Return the length of a vector (2,)."""
    return math.sqrt(vector @ vector)
