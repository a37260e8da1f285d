"""Runs a policy over the seeds of a tuning."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from nav_adapter import AwarenessPolicy

from .._errors import SimError
from .._scenario_template import ScenarioTemplate
from ..measures._episode_record import EpisodeRecord
from ..measures._record_file import read_records, write_records
from ..runs._plan import plan_jobs
from ..search._crew import Crew
from ..search._file_lock import FileLock
from ._evaluation import Evaluation
from ._settings import TuneSettings

_FOLDER: Final = "evaluations"


class Judge:
    """Runs policies over the seeds of a tuning: every seed in every scenario.

    Args:
        settings: scenarios, seeds and how to run them.
        crew: that runs them.
        folder: of the tuning; keeps the episodes of :meth:`kept`.
    """

    def __init__(self, settings: TuneSettings, crew: Crew, folder: Path) -> None:
        self._settings = settings
        self._crew = crew
        self._folder = folder
        self._templates = [ScenarioTemplate.from_text(text) for text in settings.scenarios]

    def run(self, name: str, policy: AwarenessPolicy, seeds: Sequence[int]) -> Evaluation:
        """Run a policy, or read what it came to when it was run before, here or by another process.

        Args:
            name: of the policy, the same for the same policy only.
            policy: the policy.
            seeds: that many in a row.
        """
        path = self._folder / _FOLDER / f"{name}-{seeds[0]}-{seeds[-1]}.csv"
        with FileLock(self._folder / "locks" / f"{path.stem}.lock"):
            if path.exists():
                return Evaluation.of(read_records(path))
            records = self._records(name, policy, seeds)
            if not any(record.error for record in records):
                path.parent.mkdir(parents=True, exist_ok=True)
                write_records(path, records)
            return Evaluation.of(records)

    def sure(self, name: str, policy: AwarenessPolicy, seeds: Sequence[int]) -> Evaluation:
        """The same, where every episode must have a result.

        Raises:
            SimError: when one has none.
        """
        found = self.run(name, policy, seeds)
        if found.errors:
            raise SimError(
                f"{len(found.errors)} episodes of {name} have no result; the first: "
                f"{found.errors[0]}"
            )
        return found

    def _records(
        self, name: str, policy: AwarenessPolicy, seeds: Sequence[int]
    ) -> tuple[EpisodeRecord, ...]:
        return self._crew.run(
            plan_jobs(
                self._templates,
                [(name, policy)],
                seeds,
                planners=[self._settings.planner],
                perception=self._settings.perception,
            )
        )
