"""Runs episodes for as long as a search lasts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from awarenav.closing import Closing

from ..study.measures import EpisodeRecord
from ..study.runs import Job, WorkerPool, run_here


class Crew(Closing):
    """Runs lots of episodes on the same processes; results come in the order of the jobs.

    Args:
        workers: how many processes; 1 runs everything in this one.
        each: called with every record as soon as it is there, e.g. to move a bar.
    """

    def __init__(
        self, workers: int, each: Callable[[EpisodeRecord], object] = lambda record: None
    ) -> None:
        self._each = each
        self._pool = WorkerPool(workers) if workers > 1 else None

    def close(self) -> None:
        """End the processes."""
        if self._pool is not None:
            self._pool.close()

    def run(self, jobs: Sequence[Job]) -> tuple[EpisodeRecord, ...]:
        """Run the jobs; what goes wrong in one is said in its record."""
        numbered = list(enumerate(jobs))
        records: dict[int, EpisodeRecord] = {}
        results = run_here(numbered) if self._pool is None else self._pool.run(numbered)
        for number, result in results:
            records[number] = result.record
            self._each(result.record)
        return tuple(records[number] for number, _ in numbered)
