"""Tracks of people who walk about on a map of ten metres."""

from __future__ import annotations

import numpy as np

from nav_adapter import RobotProfile, RobotState
from perception.arrays import FloatArray
from tracking import PersonTrack

SIDE_M = 10.0
ORIGIN_ODOM_M = (-0.5 * SIDE_M, -0.5 * SIDE_M)
RESOLUTION_M = 0.05
CELLS = (200, 200)
DT_S = 0.05
ROBOT = RobotProfile(
    footprint_m=np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]]),
    max_speed_mps=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
)


def robot_at(stamp_s: float) -> RobotState:
    """Return a robot in the middle of the map that drives at 0.5 m/s."""
    return RobotState(stamp_s, np.zeros(2), 0.0, 0.5, 0.0)


def crowd(people: int, frames: int, rng: np.random.Generator) -> list[tuple[PersonTrack, ...]]:
    """Return the tracks of every frame: all people walk, half of them are aware."""
    start = rng.uniform(-0.45 * SIDE_M, 0.45 * SIDE_M, (people, 2))
    direction = rng.uniform(-np.pi, np.pi, people)
    velocity = 0.7 * np.stack([np.cos(direction), np.sin(direction)], axis=1)
    lower = np.where(rng.random(people) < 0.5, 0.8, 0.0)
    covariance = np.diag([0.01, 0.01, 0.04, 0.04])
    return [
        tuple(
            PersonTrack(
                id=index,
                stamp_s=frame * DT_S,
                status="confirmed",
                position_odom_m=_on_map(start[index] + frame * DT_S * velocity[index]),
                velocity_odom_mps=velocity[index],
                covariance_odom=covariance,
                awareness=float(lower[index]),
                awareness_std=0.1,
                awareness_lower=float(lower[index]),
                height_m=1.75,
                time_since_seen_s=0.0,
            )
            for index in range(people)
        )
        for frame in range(frames)
    ]


def _on_map(position: FloatArray) -> FloatArray:
    """Return a position on the map: a person who leaves one side comes back on the other."""
    return np.asarray((position + 0.5 * SIDE_M) % SIDE_M - 0.5 * SIDE_M)
