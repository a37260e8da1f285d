"""The people of the shipped scenarios in closed loop, as scenes to measure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from sim_tests import run_crossing
from sim_tests.crossing import CrossingResult
from sim_tests.scenario import shipped_templates

from ._motion import RATE_HZ, Scene

# The robot drives with the policy that expects everybody to be unaware.
_POLICY = "blind"


def closed_loop_scenes(
    seeds: Sequence[int], people: str, names: Sequence[str] = ()
) -> Iterator[Scene]:
    """Run the shipped scenarios with the truth as perception; yield the people of each episode.

    Args:
        seeds: seeds of the episodes of each scenario.
        people: the population.
        names: names of the scenarios; empty for all that have a planner.
    """
    chosen = names or [
        template.name
        for template in shipped_templates()
        if template.median().robot.straight_on_speed_mps is None
    ]
    for seed in seeds:
        for name in chosen:
            yield scene_of(run_crossing(name, policy=_POLICY, seed=seed, population=people))


def scene_of(result: CrossingResult) -> Scene:
    """Return the people and the robot of an episode, at the rate of the recordings."""
    stamps = np.array([frame.t_s for frame in result.frames])
    places = np.array([[view.position_odom_m for view in frame.truth] for frame in result.frames])
    robot = np.array([frame.robot_state.position_odom_m for frame in result.frames])
    wanted = np.arange(stamps[0], stamps[-1], 1.0 / RATE_HZ)
    return Scene(
        CubicSpline(stamps, places)(wanted).transpose(1, 0, 2),
        vehicle=True,
        vehicle_m=CubicSpline(stamps, robot)(wanted),
    )
