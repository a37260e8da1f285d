"""A person of a crossing at one instant, whoever decides what the person does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from perception.arrays import FloatArray

from ._footing import Footing
from ._postures import Activity
from ._surroundings import Surroundings


@dataclass(frozen=True, slots=True, eq=False)
class PersonMotion:
    """A person at one instant; angles in radians.

    Attributes:
        position_odom_m: (2,) of the body's centre line.
        velocity_odom_mps: (2,).
        heading_odom_rad: the way the body faces.
        walked_m: length of the way so far.
        feet: where feet and hips are, in odom.
        head_yaw_rad: of the head from the body, left positive.
        head_pitch_rad: up positive.
        eye_yaw_rad: of the eyes in the head.
        eye_pitch_rad: of the eyes in the head.
        activity: what the hands do.
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    heading_odom_rad: float
    walked_m: float
    feet: Footing
    head_yaw_rad: float
    head_pitch_rad: float
    eye_yaw_rad: float
    eye_pitch_rad: float
    activity: Activity


class Actor(Protocol):
    """Decides what one person of a crossing does: a script, a recording or a mind of its own."""

    @property
    def stature_m(self) -> float:
        """Height of the body."""
        ...

    @property
    def look(self) -> str | None:
        """Name of a shipped worker; None is the one of the nearest stature."""
        ...

    @property
    def stride_m(self) -> float | None:
        """Distance of a full gait cycle; None follows the speed."""
        ...

    def motion(self, t_s: float, around: Surroundings) -> PersonMotion:
        """What the person does at ``t_s``; time never goes back."""
        ...

    def hold(self) -> None:
        """The last motion would have led into the robot: the body stays where it was before."""
        ...

    def touch(self, towards_x: float, towards_y: float) -> None:
        """Body and robot touch; the robot lies in this direction (a unit vector in odom)."""
        ...
