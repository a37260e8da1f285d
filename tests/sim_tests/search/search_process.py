"""A process that works on a study until it is done or killed: for tests that kill it."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

from sim_tests.search._search import Outcome, Range, Search
from sim_tests.search._trials import TrialBook

SPACE = {"x": Range(low=-1.0, high=1.0), "y": Range(low=0.1, high=10.0, log=True)}


def make_search(method: str = "tpe", generation: int = 4, seed: int = 3) -> Search:
    objectives = 1 if method == "cmaes" else 2
    return Search(method, SPACE, generation=generation, seed=seed, objectives=objectives)


def outcome(parameters: dict[str, float], objectives: int = 2) -> Outcome:
    x, y = parameters["x"], parameters["y"]
    values = (x * x + 0.1 * y, (x - 0.5) ** 2 + 1.0 / y)
    constraints = {"c": x - 0.4} if objectives > 1 else {}
    return Outcome(values[:objectives], constraints, {"note": x})


def work(folder: Path, total: int, die_at: int = -1) -> None:
    """Work on trials one by one; kill this process in the middle of trial ``die_at``."""
    with TrialBook(folder, "s", make_search(), total) as book:
        while not book.done:
            tickets = book.claim(1)
            if not tickets:
                time.sleep(0.02)
            for ticket in tickets:
                if ticket.number == die_at:
                    os.kill(os.getpid(), signal.SIGKILL)
                book.tell(ticket, outcome(ticket.parameters))


def history(folder: Path, total: int) -> list[tuple]:
    """All that a study holds, but for times."""
    with TrialBook(folder, "s", make_search(), total) as book:
        return [
            (trial.number, trial.state, trial.params, trial.values, trial.constraints)
            for trial in book.finished_trials()
        ]


if __name__ == "__main__":
    work(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
