"""A crossing with a planner given by its name, and the same task without people."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np

from ...crossing import CrossingResult, Observer, run_crossing
from ...scenario import Scenario
from ..measures import path_length_m
from ._planner_choice import import_planner, make_planner
from ._seeding import seeded_generators, torch_is_loaded

# Seed of the planner in the task without people, the same for every episode of the task.
_FREE_SEED: Final = 0


@dataclass(frozen=True, slots=True)
class FreeRun:
    """A task driven without people and without a fault.

    Attributes:
        time_s: time to goal; None if the goal was not reached.
        length_m: length of the driven path; None likewise.
        repeats: False if the user's planner gave other commands the second time, with the same
            seed. The reference planner is deterministic and drives only once.
    """

    time_s: float | None
    length_m: float | None
    repeats: bool


def seeded_crossing(
    scenario: Scenario,
    planner: str,
    seed: int,
    *,
    observer: Observer | None = None,
    **options: Any,
) -> CrossingResult:
    """Run a crossing with a new planner, with the global random generators seeded.

    Args:
        scenario: the scenario.
        planner: ``"module:Class"``, or empty for the default planner.
        seed: seed of the crossing, the planner and the generators.
        observer: as for :func:`run_crossing`.
        options: further arguments of :func:`run_crossing`.
    """
    if planner:
        import_planner(planner)  # before seeding: most import torch where their module begins
    was_loaded = torch_is_loaded()

    def run() -> CrossingResult:
        with seeded_generators(seed):
            own = make_planner(planner, scenario, seed)
            return run_crossing(scenario, planner=own, seed=seed, observer=observer, **options)

    result = run()
    if torch_is_loaded() and not was_loaded and observer is None:
        # The planner imports torch late, so what it drew was not seeded: only now it can be.
        result = run()
    return result


# Cached, because one process runs many episodes of few tasks.
@lru_cache(maxsize=4096)
def free_run(task: str, planner: str) -> FreeRun:
    """Return the figures of a task without people: JSON of a :class:`Scenario`.

    A planner of the user's drives it twice, and both must give the same commands in every cycle.
    """
    scenario = Scenario.model_validate_json(task)
    first = seeded_crossing(scenario, planner, _FREE_SEED, policy="balanced")
    repeats = True
    if planner:
        second = seeded_crossing(scenario, planner, _FREE_SEED, policy="balanced")
        repeats = _commands(first) == _commands(second)
    if first.time_to_goal_s is None:
        return FreeRun(None, None, repeats)
    path_m = np.array([frame.robot_state.position_odom_m for frame in first.frames])
    return FreeRun(first.time_to_goal_s, path_length_m(path_m), repeats)


def _commands(result: CrossingResult) -> list[tuple[float, float]]:
    return [frame.command for frame in result.frames]
