"""Processor time of the speed field and the speed map, against updates pose by pose."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotState
from nav_adapter.exporters import SpeedMap, speed_limit_at

from ._crowd import DT_S, RESOLUTION_M, ROBOT, SIDE_M, crowd, robot_at

#: Sampled trajectories, times and people.
TRAJECTORIES, TIMES, PEOPLE = 1000, 30, 10
_FRAMES = 20
# Updates that are timed; all 30 000 would take many seconds.
_UPDATES = 200


def field_ms(repeats: int, seed: int) -> dict[str, float]:
    """Return the least processor milliseconds over the repeats.

    ``field`` is for positions alone, ``headed`` for headings too, ``driven`` for speeds and yaw
    rates too, ``map`` for 200 × 200 cells, and ``updates`` for as many calls of
    :meth:`NavAdapter.update` as the field has poses.
    """
    rng = np.random.default_rng([seed, PEOPLE])
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT)
    tracks = crowd(PEOPLE, _FRAMES, rng)
    for frame, current in enumerate(tracks):
        now = frame * DT_S
        constraints: NavConstraints = adapter.update(current, robot_at(now), now)
    shape = TRAJECTORIES, TIMES
    positions = rng.uniform(-4.0, 4.0, (*shape, 2))
    headings, speeds = rng.uniform(-np.pi, np.pi, shape), rng.uniform(0.1, 1.5, shape)
    rates = rng.uniform(-1.0, 1.0, shape)
    poses = [
        RobotState(now, position, heading, speed, 0.0)
        for position, heading, speed in zip(
            positions[:_UPDATES, 0], headings[:_UPDATES, 0], speeds[:_UPDATES, 0], strict=True
        )
    ]

    def updates() -> None:
        for pose in poses:
            adapter.update(tracks[-1], pose, now)

    work: dict[str, Callable[[], object]] = {
        "field": lambda: speed_limit_at(constraints, positions, dt_s=0.1),
        "headed": lambda: speed_limit_at(constraints, positions, headings, dt_s=0.1),
        "driven": lambda: speed_limit_at(
            constraints, positions, headings, dt_s=0.1, speeds_mps=speeds, yaw_rates_radps=rates
        ),
        "map": lambda: SpeedMap.around(
            constraints, [0.0, 0.0], size_m=SIDE_M, resolution_m=RESOLUTION_M
        ),
        "updates": updates,
    }
    least = {name: _least_ms(repeats, each) for name, each in work.items()}
    least["updates"] *= TRAJECTORIES * TIMES / len(poses)
    return least


def _least_ms(repeats: int, work: Callable[[], object]) -> float:
    least_s = np.inf
    for _ in range(repeats):
        began = time.thread_time()
        work()
        least_s = min(least_s, time.thread_time() - began)
    return 1e3 * float(least_s)
