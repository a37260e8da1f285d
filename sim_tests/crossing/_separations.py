"""Robot and people where they are nearest to each other, their margins, and contacts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from nav_adapter import RobotProfile, protective_separation_m
from nav_adapter.rigid import Motion
from perception.arrays import FloatArray

from ..world import Nearest

#: A robot at this speed or slower counts as standing (wheel motors never hold exactly zero).
STANDING_SPEED_MPS: Final = 0.03
#: C + Z of the separation margin, as in speed-and-separation monitoring (ISO 13855).
CLEARANCE_M: Final = 0.10
#: Distance to a person within which the robot's highest speed is reported.
NEAR_M: Final = 2.0

# Share of a normal that must be level to say where a body lies.
_LEVEL: Final = 0.3

Vector = tuple[float, float]


class Approach(NamedTuple):
    """Robot and one person at one instant, where they are nearest to each other, in odom.

    Attributes:
        separation_m: distance between the surfaces, 0 when touching; infinite for a person who is
            away.
        towards_person: unit vector from the robot to the person.
        robot_mps: velocity of the point of the robot that is nearest to the person.
        person_mps: velocity of the person.
    """

    separation_m: float
    towards_person: Vector
    robot_mps: Vector
    person_mps: Vector = (0.0, 0.0)

    @classmethod
    def at(cls, nearest: Nearest, robot: Motion, person_mps: Vector, towards: Vector) -> Approach:
        """Return the approach where two bodies are nearest.

        Args:
            nearest: the places, first on the robot and then on the person.
            robot: motion of the robot.
            person_mps: velocity of the person.
            towards: direction where the places do not tell it, as with one above the other.
        """
        (x, y, _), (to_x, to_y, _) = nearest.first_odom_m, nearest.second_odom_m
        separation_m, level = max(nearest.distance_m, 0.0), 1e-3
        gap = to_x - x, to_y - y
        if separation_m == 0.0:  # the bodies overlap
            gap, level = (-nearest.towards_first[0], -nearest.towards_first[1]), _LEVEL
        length = math.hypot(*gap)
        if length > level:
            towards = gap[0] / length, gap[1] / length
        return cls(separation_m, towards, robot.velocity_at(x, y), person_mps)

    @property
    def robot_speed_mps(self) -> float:
        """Speed of the robot's nearest point."""
        return math.hypot(*self.robot_mps)

    @property
    def closing_mps(self) -> float:
        """Speed of the robot's nearest point towards the person, negative away from them."""
        (x, y), (vx, vy) = self.towards_person, self.robot_mps
        return x * vx + y * vy

    @property
    def person_closing_mps(self) -> float:
        """Speed of the person towards the robot, negative away from it."""
        (x, y), (vx, vy) = self.towards_person, self.person_mps
        return -x * vx - y * vy


#: The approach of somebody who is away.
AWAY: Final = Approach(math.inf, (0.0, 0.0), (0.0, 0.0))


@dataclass(frozen=True, slots=True)
class ContactEvent:
    """A contact of robot and person, as observed when it began.

    Attributes:
        t_s: time at which it began.
        worker: number of the person.
        approach: robot and person where they touch, before the collision; the velocity of a robot
            whose wheels stand is 0.
    """

    t_s: float
    worker: int
    approach: Approach

    @property
    def by(self) -> Literal["robot", "person"]:
        """``"robot"`` if the robot's touching point moved towards the person, else ``"person"``."""
        return "robot" if self.approach.closing_mps > STANDING_SPEED_MPS else "person"

    @property
    def robot_speed_mps(self) -> float:
        """Speed of the robot's touching point."""
        return self.approach.robot_speed_mps

    @property
    def robot_velocity_odom_mps(self) -> FloatArray:
        """(2,) velocity of the robot's touching point."""
        return np.array(self.approach.robot_mps)


def contact_by(contacts: Iterable[ContactEvent]) -> Literal["", "robot", "person"]:
    """Return ``"robot"`` if the robot caused a contact, else ``"person"``; empty for none."""
    causes = {contact.by for contact in contacts}
    return "robot" if "robot" in causes else "person" if causes else ""


def moves(motion: Motion, robot: RobotProfile) -> bool:
    """Return whether a point of the robot moves: it drives, or turns on the spot."""
    return motion.fastest_mps(robot.circumscribed_radius_m) > STANDING_SPEED_MPS


def margins_m(approaches: Sequence[Approach], robot: RobotProfile, *, moves: bool) -> list[float]:
    """Return the separation margin of each person.

    The margin S − S_p is the distance between the surfaces of robot and person, minus the
    protective separation of ISO 13855 and ISO/TS 15066 for their true closing speeds. A standing
    robot has done what the standards ask: its margin is S − C − Z.

    Args:
        approaches: robot and person, for each person.
        robot: limits of the robot.
        moves: whether a point of the robot moves.
    """
    needed_m = np.full(len(approaches), CLEARANCE_M)
    if moves:
        needed_m = protective_separation_m(
            [max(each.closing_mps, 0.0) for each in approaches],
            [max(each.person_closing_mps, 0.0) for each in approaches],
            deceleration_mps2=robot.max_deceleration_mps2,
            reaction_time_s=robot.reaction_time_s,
            clearance_m=CLEARANCE_M,
        )
    pairs = zip(approaches, needed_m.tolist(), strict=True)
    return [each.separation_m - least_m for each, least_m in pairs]
