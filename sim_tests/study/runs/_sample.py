"""A random sample of a plan that holds every fault, scenario and policy equally often."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from perception.arrays import finite_number

from ...world.errors import SimError
from ._job import Job

# Makes the draw independent of the episodes, whose generators have the seed alone.
_STREAM: Final = 83


def sample_jobs(jobs: Sequence[Job], count: int, seed: int = 0) -> tuple[Job, ...]:
    """Return some of the jobs, drawn at random and in the order of the plan.

    Faults are drawn in rounds: each once, in random order, before any is drawn again. Within the
    jobs of a fault, those come first whose scenario, then whose policy, planner and perception,
    were drawn least. Otherwise chance decides. A smaller sample with the same seed is part of a
    larger one.

    Args:
        jobs: the plan, for example of :func:`plan_jobs`.
        count: number of jobs to draw.
        seed: of the draw.

    Raises:
        SimError: for a count that is no whole number of jobs of the plan, at least 1.
    """
    number = finite_number("sample", count, SimError, minimum=1, maximum=len(jobs))
    if number != int(number):
        raise SimError(f"sample must be a whole number of episodes, got {count!r}")
    rng = np.random.default_rng([seed, _STREAM])
    left: dict[str, list[int]] = {}
    for row in rng.permutation(len(jobs)).tolist():
        left.setdefault(jobs[row].fault_name, []).append(row)
    faults = sorted(left)
    scenarios: Counter[str] = Counter()
    variants: Counter[tuple[str, str, str]] = Counter()
    drawn: list[int] = []
    while len(drawn) < number:
        for place in rng.permutation(len(faults)).tolist():
            rows = left[faults[place]]
            if not rows:
                continue
            row = min(
                rows, key=lambda r: (scenarios[jobs[r].scenario], variants[_variant(jobs[r])])
            )
            rows.remove(row)
            scenarios[jobs[row].scenario] += 1
            variants[_variant(jobs[row])] += 1
            drawn.append(row)
    return tuple(jobs[row] for row in sorted(drawn[: int(number)]))


def _variant(job: Job) -> tuple[str, str, str]:
    return job.policy_name, job.planner, job.perception
