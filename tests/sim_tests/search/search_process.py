"""A process that works on a study until it is done or killed: for tests that kill it."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from sim_tests.search import Claim, Optimizer, Outcome, Range, SharedStudy

SPACE = {"x": Range(low=-1.0, high=1.0), "y": Range(low=0.1, high=10.0, log=True)}


def make_optimizer(sampler: str = "tpe", generation: int = 4, seed: int = 3) -> Optimizer:
    objectives = 1 if sampler == "cmaes" else 2
    return Optimizer(sampler, SPACE, generation=generation, seed=seed, objectives=objectives)


def outcome(parameters: dict[str, float], objectives: int = 2) -> Outcome:
    x, y = parameters["x"], parameters["y"]
    values = (x * x + 0.1 * y, (x - 0.5) ** 2 + 1.0 / y)
    constraints = {"c": x - 0.4} if objectives > 1 else {}
    return Outcome(values[:objectives], constraints, {"note": x})


def work(folder: Path, total: int, die_at: int = -1) -> None:
    """Evaluate trials one by one; kill this process in the middle of trial ``die_at``."""

    def outcomes_of(claims: Sequence[Claim]) -> list[Outcome]:
        if any(claim.number == die_at for claim in claims):
            os.kill(os.getpid(), signal.SIGKILL)
        return [outcome(claim.parameters) for claim in claims]

    with SharedStudy(folder, "s", make_optimizer(), total) as study:
        while not study.is_complete:
            if not study.evaluate(1, outcomes_of):
                time.sleep(0.02)


def history(folder: Path, total: int) -> list[tuple]:
    """Everything that a study holds, except times."""
    with SharedStudy(folder, "s", make_optimizer(), total) as study:
        return [
            (trial.number, trial.state, trial.params, trial.values, trial.constraints)
            for trial in study.finished_trials()
        ]


if __name__ == "__main__":
    work(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
