"""The episodes of a search, run by the same processes from its beginning to its end."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from tqdm import tqdm

from ..study.measures import EpisodeRecord, nondeterminism_notes
from ..study.runs import Job, Workers, attempt, died
from ..world.bullet import require_pybullet


class EpisodeRunner:
    """Runs batches of episodes; the records come in the order of the jobs.

    Args:
        workers: number of processes; 1 runs everything in this process.
        label: label of the progress bar.
        total: number of episodes, if known.

    Attributes:
        bar: the progress bar on standard error, which counts episodes.
    """

    def __init__(self, workers: int, label: str, total: int | None = None) -> None:
        self._workers = Workers(workers)
        self._unrepeatable: set[str] = set()
        self.bar = tqdm(desc=label, total=total, unit="episode", smoothing=0.05, file=sys.stderr)

    def __enter__(self) -> EpisodeRunner:
        require_pybullet()
        return self

    def __exit__(self, *_: object) -> None:
        self._workers.__exit__()
        self.bar.close()

    def run(self, jobs: Sequence[Job]) -> tuple[EpisodeRecord, ...]:
        """Run the jobs; ``error`` of a record says why an episode failed.

        A planner that is not deterministic is named once on standard error.
        """
        records: dict[int, EpisodeRecord] = {}
        for number, outcome in self._workers.results(attempt, jobs, on_death=died):
            records[number] = outcome.record
            self.bar.update()
        differing = [each for each in records.values() if each.nondeterministic]
        new = {record.planner for record in differing} - self._unrepeatable
        self._unrepeatable |= new
        for note in nondeterminism_notes(each for each in differing if each.planner in new):
            self.bar.write(note, file=sys.stderr)
        return tuple(records[number] for number in range(len(jobs)))
