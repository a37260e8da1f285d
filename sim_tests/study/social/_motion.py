"""Motion and social forces of robot and people, as the programmes of others compute them.

The force is that of Moussaïd et al. (2009, Proc. R. Soc. B 276:2755) with the constants of HuNavSim
(class ``SFM`` of its evaluator, after the library lightsfm). Forces have the unit m/s².
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._episode import SocialEpisode, wrapped

# Constants of HuNavSim's evaluator: strengths (m/s²) and ranges (m), and those of the interaction.
_SOCIAL_MPS2: Final = 2.1
_OBSTACLE_MPS2: Final = 10.0
_OBSTACLE_RANGE_M: Final = 0.2
_LAMBDA: Final = 2.0
_GAMMA: Final = 0.35
_N: Final = 2.0
_N_PRIME: Final = 3.0


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
