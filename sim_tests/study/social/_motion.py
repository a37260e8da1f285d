"""Measures of paths and motion: lengths, turning, accelerations and jerks, as others define them.

docs/social_measures.md names the sources. Where a published programme departs from its own text,
the page says which of the two is computed here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from perception.arrays import FloatArray

from ..measures import path_length_m
from ._episode import SocialEpisode, wrapped


def success_weighted(
    success: bool | None, actual: float | None, best: float | None
) -> float | None:
    """Return S · l / max(p, l): SPL with lengths, STL with times.

    Args:
        success: S.
        actual: p, the length or time of the episode; not used without success.
        best: l > 0, that of the reference.

    Returns:
        None where success or reference is not known.
    """
    if success is None or best is None or best <= 0.0 or (success and actual is None):
        return None
    return best / max(actual or 0.0, best) if success else 0.0


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


@dataclass(frozen=True, slots=True)
class TrackMotion:
    """Sums over tracks from which NavWareSet's averages follow: Σ |x| dt and Σ dt.

    Attributes:
        acceleration: (Σ |a| dt, Σ dt), m/s and s.
        jerk: (Σ |j| dt, Σ dt), m/s² and s.
    """

    acceleration: tuple[float, float]
    jerk: tuple[float, float]

    @classmethod
    def of(cls, t_s: FloatArray, positions_m: FloatArray) -> TrackMotion:
        """Return the sums of one track of (N,) times and (N, 2) positions.

        Speed belongs to an interval; acceleration is the change to the interval before, over the
        later interval's duration; jerk likewise.
        """
        dt = np.diff(t_s)
        speed = np.hypot(*np.diff(positions_m, axis=0).T) / dt
        acceleration = np.diff(speed) / dt[1:]
        jerk = np.diff(acceleration) / dt[2:]
        return cls(
            (float((np.abs(acceleration) * dt[1:]).sum()), float(dt[1:].sum())),
            (float((np.abs(jerk) * dt[2:]).sum()), float(dt[2:].sum())),
        )


def robot_track(episode: SocialEpisode) -> TrackMotion:
    """Return the motion of the robot."""
    return TrackMotion.of(episode.t_s, episode.robot_m)


def people_tracks(episode: SocialEpisode) -> TrackMotion:
    """Return the motion of all people together, each over the times at which they are there."""
    tracks = [
        TrackMotion.of(episode.t_s[there], episode.people_m[there, person])
        for person, there in enumerate(episode.present.T)
    ]
    return TrackMotion(
        (
            sum(each.acceleration[0] for each in tracks),
            sum(each.acceleration[1] for each in tracks),
        ),
        (sum(each.jerk[0] for each in tracks), sum(each.jerk[1] for each in tracks)),
    )


def mean_of(sums: tuple[float, float]) -> float | None:
    """Return the time-weighted mean of :class:`TrackMotion`; None for tracks that are too short."""
    return sums[0] / sums[1] if sums[1] > 0.0 else None


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
