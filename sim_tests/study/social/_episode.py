"""The course of an episode as plain arrays, and its motion and social forces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
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
# Constants of HuNavSim's evaluator: strengths (m/s²) and ranges (m), and those of the interaction.
_SOCIAL_MPS2: Final = 2.1
_OBSTACLE_MPS2: Final = 10.0
_OBSTACLE_RANGE_M: Final = 0.2
_LAMBDA: Final = 2.0
_GAMMA: Final = 0.35
_N: Final = 2.0
_N_PRIME: Final = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class SocialEpisode:
    """The course of an episode: N instants, P people, all in one fixed frame (odom).

    A person who is not there at an instant has NaN in all arrays of people. None stands for a
    figure that is not known, as in a file that does not hold it.

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
        name: a text that identifies the episode.
        success: the goal was reached and nobody was hit.
        time_to_goal_s: None when the goal was not reached, too.
        reference_time_s: time to goal of the same planner in the empty hall.
        reference_length_m: length of the path that it drove there.
        human_delay_s: delay of all people so far, over their walks without a robot.

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
    name: str = ""
    success: bool | None = None
    time_to_goal_s: float | None = None
    reference_time_s: float | None = None
    reference_length_m: float | None = None
    human_delay_s: float | None = None

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


def heading_changes_rad(headings_rad: FloatArray) -> float:
    """Return the sum of the magnitudes of all changes between (N,) headings, each at most π."""
    return float(np.abs(wrapped(np.diff(headings_rad))).sum())


def speed_changes(episode: SocialEpisode, power: int) -> float:
    """Return Σ Δv/Δtⁿ of the robot's speed over N − 1 steps, divided by N."""
    speeds, steps = np.diff(episode.robot_speed_mps), np.diff(episode.t_s)
    return float((speeds / steps**power).sum()) / len(episode.t_s)


def gym_motion(episode: SocialEpisode) -> tuple[FloatArray, ...]:
    """Return SocNavGym's (N − 1,) magnitudes of velocity, acceleration and jerk of the robot.

    They are those after the first instant. The velocity counts in the base frame, so that turning
    is no acceleration. Velocity and acceleration before the first of these instants are 0, as after
    a reset.
    """
    dt = np.diff(episode.t_s)[:, None]
    velocity = episode.robot_base_mps[1:]
    acceleration = np.diff(velocity, axis=0, prepend=np.zeros((1, 2))) / dt
    jerk = np.diff(acceleration, axis=0, prepend=np.zeros((1, 2))) / dt
    return tuple(np.hypot(each[:, 0], each[:, 1]) for each in (velocity, acceleration, jerk))


def robot_motion(episode: SocialEpisode) -> tuple[float | None, float | None]:
    """Return NavWareSet's mean |acceleration| (m/s²) and |jerk| (m/s³) of the robot."""
    always = np.ones(len(episode.t_s), dtype=np.bool_)
    return _navware_motion(episode.t_s, [(always, episode.robot_m)])


def people_motion(episode: SocialEpisode) -> tuple[float | None, float | None]:
    """Return those of all people, each over the times at which they are there."""
    tracks = zip(episode.present.T, np.moveaxis(episode.people_m, 1, 0), strict=True)
    return _navware_motion(episode.t_s, tracks)


def _navware_motion(
    t_s: FloatArray, tracks: Iterable[tuple[NDArray[np.bool_], FloatArray]]
) -> tuple[float | None, float | None]:
    """Return NavWareSet's mean |acceleration| (m/s²) and |jerk| (m/s³) of tracks, weighted by time.

    Speed belongs to an interval; acceleration is the change to the interval before, over the later
    interval's duration; jerk likewise.

    Args:
        t_s: (N,) times.
        tracks: of each body, (N,) whether it is there, and (N, 2) positions.

    Returns:
        None for tracks that are too short.
    """
    sums = np.zeros(4)  # Σ |a| dt, Σ dt, Σ |j| dt, Σ dt
    for there, positions_m in tracks:
        dt = np.diff(t_s[there])
        speed = np.hypot(*np.diff(positions_m[there], axis=0).T) / dt
        acceleration = np.diff(speed) / dt[1:]
        jerk = np.diff(acceleration) / dt[2:]
        sums += [
            (np.abs(acceleration) * dt[1:]).sum(),
            dt[1:].sum(),
            (np.abs(jerk) * dt[2:]).sum(),
            dt[2:].sum(),
        ]
    accelerations, accelerated_s, jerks, jerked_s = sums.tolist()
    return (
        accelerations / accelerated_s if accelerated_s > 0.0 else None,
        jerks / jerked_s if jerked_s > 0.0 else None,
    )


def social_force(
    from_m: FloatArray, from_mps: FloatArray, on_m: FloatArray, on_mps: FloatArray
) -> FloatArray:
    """Return the social force that one body exerts on another.

    Args:
        from_m: (..., 2) position of the body that exerts it.
        from_mps: (..., 2) its velocity.
        on_m: (..., 2) position of the body on which it acts.
        on_mps: (..., 2) its velocity.

    Returns:
        (..., 2) m/s²; 0 for two bodies at one place, which have no direction.
    """
    offset = from_m - on_m
    distance = np.linalg.norm(offset, axis=-1)
    direction = offset / np.where(distance > 0.0, distance, 1.0)[..., None]
    interaction = _LAMBDA * (on_mps - from_mps) + direction
    length = np.linalg.norm(interaction, axis=-1)
    acts = (distance > 0.0) & (length > 0.0)
    length = np.where(length > 0.0, length, 1.0)
    along = interaction / length[..., None]
    theta = wrapped(
        np.arctan2(along[..., 1], along[..., 0]) - np.arctan2(direction[..., 1], direction[..., 0])
    )
    reach = _GAMMA * length
    slowing = -np.exp(-distance / reach - (_N_PRIME * reach * theta) ** 2)
    turning = np.sign(theta) * np.exp(-distance / reach - (_N * reach * theta) ** 2)
    left = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    force = _SOCIAL_MPS2 * (slowing[..., None] * along + turning[..., None] * left)
    return np.where(acts[..., None], force, 0.0)


def obstacle_force_mps2(points_m: FloatArray, radius_m: float, walls_m: FloatArray) -> FloatArray:
    """Return the (N,) magnitudes of the force of the nearest wall on discs at (N, 2) points.

    Args:
        points_m: (N, 2) centres.
        radius_m: of the discs.
        walls_m: (W, 4) straight walls; without any, the force is 0.
    """
    if not len(walls_m):
        return np.zeros(len(points_m))
    start, along = walls_m[:, :2], walls_m[:, 2:] - walls_m[:, :2]
    length2 = (along**2).sum(axis=1)
    to = points_m[:, None, :] - start
    share = (to * along).sum(axis=-1) / np.where(length2 > 0.0, length2, 1.0)
    feet = start + np.clip(share, 0.0, 1.0)[..., None] * along
    distance = np.linalg.norm(points_m[:, None, :] - feet, axis=-1).min(axis=1)
    strength: FloatArray = _OBSTACLE_MPS2 * np.exp(-(distance - radius_m) / _OBSTACLE_RANGE_M)
    return np.where(distance > 0.0, strength, 0.0)  # on the wall it has no direction


@dataclass(frozen=True, slots=True)
class SocialWork:
    """HuNavSim's sums of forces over all instants; they grow with the rate of the instants.

    Attributes:
        on_people: Σ of the magnitudes of the robot's forces on each person.
        on_robot: Σ of the magnitudes of each person's force on the robot.
        obstacles_on_robot: Σ of the magnitudes of the walls' force on the robot.
        work: Σ of |sum of the people's forces on the robot| + |walls' force on the robot| +
            ``on_people``.
    """

    on_people: float
    on_robot: float
    obstacles_on_robot: float
    work: float

    @classmethod
    def of(cls, episode: SocialEpisode) -> SocialWork:
        """Return the sums of an episode."""
        there = episode.present[..., None]
        robot = np.broadcast_to(episode.robot_m[:, None, :], episode.people_m.shape)
        robot_mps = np.broadcast_to(episode.robot_mps[:, None, :], episode.people_m.shape)
        people, people_mps = episode.people_m, episode.people_mps
        on_people = np.where(there, social_force(robot, robot_mps, people, people_mps), 0.0)
        on_robot = np.where(there, social_force(people, people_mps, robot, robot_mps), 0.0)
        walls_sum = float(
            obstacle_force_mps2(episode.robot_m, episode.robot_radius_m, episode.walls_m).sum()
        )
        people_sum = float(np.linalg.norm(on_people, axis=-1).sum())
        together = float(np.linalg.norm(on_robot.sum(axis=1), axis=-1).sum())
        return cls(
            on_people=people_sum,
            on_robot=float(np.linalg.norm(on_robot, axis=-1).sum()),
            obstacles_on_robot=walls_sum,
            work=together + walls_sum + people_sum,
        )
