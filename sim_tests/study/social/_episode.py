"""The course of an episode as plain arrays: all that the measures and the file formats need."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray, finite_array, finite_number, set_fields

from ...world.errors import SimError

# People belong together who keep this near, with velocities this alike, for this share of the time.
_TOGETHER_M: Final = 1.5
_TOGETHER_MPS: Final = 0.3
_TOGETHER_SHARE: Final = 0.8


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of an episode, and what it is compared with.

    None stands for a figure that is not known, as in a file that does not hold it.

    Attributes:
        success: the goal was reached and nobody was hit.
        time_to_goal_s: None when the goal was not reached, too.
        reference_time_s: time to goal of the same planner in the empty hall.
        reference_length_m: length of the path that it drove there.
        human_delay_s: delay of all people so far, over their walks without a robot.
    """

    success: bool | None = None
    time_to_goal_s: float | None = None
    reference_time_s: float | None = None
    reference_length_m: float | None = None
    human_delay_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SocialEpisode:
    """The course of an episode: N instants, P people, all in one fixed frame (odom).

    A person who is not there at an instant has NaN in all arrays of people.

    Attributes:
        t_s: (N,) increasing.
        robot_m: (N, 2) positions of the base origin.
        robot_heading_rad: (N,) headings of the robot.
        robot_mps: (N, 2) velocities of the base origin.
        yaw_rate_radps: (N,) yaw rates of the robot.
        people_m: (N, P, 2) positions of the people's centre lines.
        people_heading_rad: (N, P) headings of their bodies.
        people_mps: (N, P, 2) their velocities.
        robot_size_m: length along the heading and width of the robot, of a rectangle centred on the
            base origin.
        robot_radius_m: radius of the circle about the base origin that contains the robot.
        person_radius_m: radius of the disc of a person.
        goal_m: (2,) goal of the robot; None where it is not known.
        goal_tolerance_m: distance from the goal at which it counts as reached.
        walls_m: (W, 4) straight walls x1, y1, x2, y2; the sides of racks are walls as well.
        boxes_m: (B, 4) x_min, y_min, x_max, y_max of what fills its box; their sides are in
            ``walls_m``.
        outcome: success, times and reference.
        name: a text that identifies the episode.

    Raises:
        SimError: a wrong shape, times that do not increase, or a number that is not finite.
    """

    t_s: FloatArray
    robot_m: FloatArray
    robot_heading_rad: FloatArray
    robot_mps: FloatArray
    yaw_rate_radps: FloatArray
    people_m: FloatArray
    people_heading_rad: FloatArray
    people_mps: FloatArray
    robot_size_m: tuple[float, float]
    robot_radius_m: float
    person_radius_m: float = BODY_RADIUS_M
    goal_m: FloatArray | None = None
    goal_tolerance_m: float = 0.25
    walls_m: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    boxes_m: FloatArray = field(default_factory=lambda: np.zeros((0, 4)))
    outcome: Outcome = Outcome()
    name: str = ""

    def __post_init__(self) -> None:
        t_s = finite_array("t_s", self.t_s, ("N",), SimError)
        count = len(t_s)
        if count == 0 or (np.diff(t_s) <= 0.0).any():
            raise SimError(f"t_s must hold at least one time and increase, got {count} times")
        checked: dict[str, Any] = {"t_s": t_s}
        fixed: dict[str, tuple[int | str, ...]] = {
            "robot_m": (count, 2),
            "robot_heading_rad": (count,),
            "robot_mps": (count, 2),
            "yaw_rate_radps": (count,),
            "walls_m": ("W", 4),
            "boxes_m": ("B", 4),
        }
        for name, shape in fixed.items():
            checked[name] = finite_array(name, getattr(self, name), shape, SimError)
        people_m = np.asarray(self.people_m, dtype=np.float64)
        if people_m.ndim != 3 or len(people_m) != count:
            raise SimError(f"people_m must have shape ({count}, P, 2), got {people_m.shape}")
        absent = np.isnan(people_m[..., 0]) | np.isnan(people_m[..., 1])
        people = people_m.shape[1]
        for name in ("people_m", "people_heading_rad", "people_mps"):
            wanted = (count, people) if name == "people_heading_rad" else (count, people, 2)
            values = np.array(getattr(self, name), dtype=np.float64)
            if values.shape != wanted:
                raise SimError(f"{name} must have shape {wanted}, got {values.shape}")
            finite_array(name, values[~absent], ("M", *wanted[2:]), SimError)
            values[absent] = np.nan
            values.setflags(write=False)
            checked[name] = values
        if self.goal_m is not None:
            checked["goal_m"] = finite_array("goal_m", self.goal_m, (2,), SimError)
        for name in ("robot_radius_m", "person_radius_m", "goal_tolerance_m"):
            finite_number(name, getattr(self, name), SimError, minimum=0.0)
        set_fields(self, **checked)

    @property
    def people(self) -> int:
        """Number of people."""
        return int(self.people_m.shape[1])

    @property
    def present(self) -> NDArray[np.bool_]:
        """(N, P) whether each person is there."""
        there: NDArray[np.bool_] = ~np.isnan(self.people_m[..., 0])
        return there

    @property
    def robot_speed_mps(self) -> FloatArray:
        """(N,) speeds in the direction of travel, at least 0."""
        speeds: FloatArray = np.hypot(self.robot_mps[:, 0], self.robot_mps[:, 1])
        return speeds

    @property
    def robot_base_mps(self) -> FloatArray:
        """(N, 2) velocities in the base frame, forward and left."""
        cos, sin = np.cos(self.robot_heading_rad), np.sin(self.robot_heading_rad)
        x, y = self.robot_mps.T
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)

    @property
    def centre_distance_m(self) -> FloatArray:
        """(N, P) distances between the centres of robot and people; infinite for the absent."""
        offsets = self.people_m - self.robot_m[:, None, :]
        distances = np.hypot(offsets[..., 0], offsets[..., 1])
        return np.where(self.present, distances, np.inf)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """People who stay together, as sorted numbers of people; see docs/social_measures.md.

        Two people stay together if they are within 1.5 m of each other with velocities that differ
        by at most 0.3 m/s for at least 80 % of the time for which both are there. A group is a set
        of people who are linked so, directly or through others.
        """
        if not self.people:
            return ()
        both = self.present[:, :, None] & self.present[:, None, :]
        apart, differ = (
            np.linalg.norm(each[:, :, None] - each[:, None, :], axis=-1)
            for each in (self.people_m, self.people_mps)
        )
        near = both & (apart <= _TOGETHER_M) & (differ <= _TOGETHER_MPS)
        share = near.sum(axis=0) / np.maximum(both.sum(axis=0), 1)
        _, group_of = connected_components(share >= _TOGETHER_SHARE)
        groups = (np.flatnonzero(group_of == group) for group in np.unique(group_of))
        return tuple(tuple(each.tolist()) for each in groups if len(each) > 1)


def sides(boxes_m: Sequence[Sequence[float]] | FloatArray) -> FloatArray:
    """Return the (4 B, 4) sides of (B, 4) boxes as walls x1, y1, x2, y2."""
    walls = [
        wall
        for x0, y0, x1, y1 in np.asarray(boxes_m, dtype=np.float64).reshape(-1, 4).tolist()
        for wall in ((x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0))
    ]
    return np.array(walls, dtype=np.float64).reshape(-1, 4)


def wrapped(angles_rad: FloatArray) -> FloatArray:
    """Return angles in (−π, π]."""
    turned = np.remainder(angles_rad + math.pi, math.tau) - math.pi
    return np.where(turned == -math.pi, math.pi, turned)
