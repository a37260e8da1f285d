"""Measures of paths and motion: lengths, turning, accelerations and jerks, as others define them.

docs/social_measures.md names the sources. Where a published programme departs from its own text,
the page says which of the two is computed here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..measures import path_length_m
from ._episode import SocialEpisode, wrapped


def heading_changes_rad(headings_rad: FloatArray) -> float:
    """Return the sum of the magnitudes of all changes between (N,) headings, each at most π."""
    return float(np.abs(wrapped(np.diff(headings_rad))).sum())


def excess_rotation_rad(episode: SocialEpisode) -> float | None:
    """Return the rotation of the robot over the least that the straight way to the goal needs.

    None without a known goal. The straight way needs the turn from the first heading to the goal.
    """
    if episode.goal_m is None:
        return None
    towards = episode.goal_m - episode.robot_m[0]
    least = 0.0
    if towards.any():
        turn = math.atan2(towards[1], towards[0]) - float(episode.robot_heading_rad[0])
        least = abs(float(wrapped(np.array(turn))))
    return heading_changes_rad(episode.robot_heading_rad) - least


def irregularity_radpm(episode: SocialEpisode) -> float | None:
    """Return the excess rotation per metre of the driven path; None for a path of length 0."""
    excess, length = excess_rotation_rad(episode), path_length_m(episode.robot_m)
    return None if excess is None or length == 0.0 else excess / length


def mean_goal_angle_rad(episode: SocialEpisode) -> float | None:
    """Return the mean angle between heading and direction to the goal, over all instants.

    Instants exactly at the goal have no direction and are left out.
    """
    if episode.goal_m is None:
        return None
    towards = episode.goal_m - episode.robot_m
    away = np.hypot(towards[:, 0], towards[:, 1]) > 0.0
    if not away.any():
        return None
    angles = np.arctan2(towards[:, 1], towards[:, 0]) - episode.robot_heading_rad
    return float(np.abs(wrapped(angles[away])).mean())


def navware_motion(
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


def robot_motion(episode: SocialEpisode) -> tuple[float | None, float | None]:
    """Return :func:`navware_motion` of the robot."""
    always = np.ones(len(episode.t_s), dtype=np.bool_)
    return navware_motion(episode.t_s, [(always, episode.robot_m)])


def people_motion(episode: SocialEpisode) -> tuple[float | None, float | None]:
    """Return :func:`navware_motion` of all people, each over the times at which they are there."""
    tracks = zip(episode.present.T, np.moveaxis(episode.people_m, 1, 0), strict=True)
    return navware_motion(episode.t_s, tracks)


def people_heading_changes_rad(episode: SocialEpisode) -> float | None:
    """Return the heading changes of all people together; None without people."""
    if not episode.people:
        return None
    return sum(
        heading_changes_rad(episode.people_heading_rad[there, person])
        for person, there in enumerate(episode.present.T)
    )


def hunav_acceleration_mps2(episode: SocialEpisode) -> float:
    """Return HuNavSim's average acceleration: Σ Δv/Δt over N − 1 steps, divided by N; signed."""
    speeds, steps = np.diff(episode.robot_speed_mps), np.diff(episode.t_s)
    return float((speeds / steps).sum()) / len(episode.t_s)


def hunav_overacceleration_mps3(episode: SocialEpisode) -> float:
    """Return HuNavSim's average over-acceleration: Σ Δv/Δt² over N − 1 steps, divided by N."""
    speeds, steps = np.diff(episode.robot_speed_mps), np.diff(episode.t_s)
    return float((speeds / steps**2).sum()) / len(episode.t_s)


def hunav_people_speed_mps(episode: SocialEpisode) -> float | None:
    """Return the mean speed of all people over all instants at which they are there."""
    if not episode.present.any():
        return None
    velocities = episode.people_mps[episode.present]
    return float(np.hypot(velocities[:, 0], velocities[:, 1]).mean())


@dataclass(frozen=True, slots=True)
class GymMotion:
    """SocNavGym's motion of the robot: magnitudes at the N − 1 instants after the first.

    The velocity counts in the base frame, so that turning is no acceleration. Velocity and
    acceleration before the first of these instants are 0, as after a reset.

    Attributes:
        speed_mps: (N − 1,) speeds.
        acceleration_mps2: (N − 1,) accelerations.
        jerk_mps3: (N − 1,) jerks.
        path_length_m: Σ speed · Δt.
    """

    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    jerk_mps3: FloatArray
    path_length_m: float

    @classmethod
    def of(cls, episode: SocialEpisode) -> GymMotion:
        """Return the motion of the robot in an episode."""
        dt = np.diff(episode.t_s)[:, None]
        velocity = episode.robot_base_mps[1:]
        acceleration = np.diff(velocity, axis=0, prepend=np.zeros((1, 2))) / dt
        jerk = np.diff(acceleration, axis=0, prepend=np.zeros((1, 2))) / dt
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        return cls(
            speed,
            np.hypot(acceleration[:, 0], acceleration[:, 1]),
            np.hypot(jerk[:, 0], jerk[:, 1]),
            float((speed * dt[:, 0]).sum()),
        )
