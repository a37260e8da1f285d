"""The evaluation of a policy over the seeds of a tuning."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from nav_adapter import AwarenessPolicy

from ...study.measures import EpisodeRecord, read_records, write_records
from ...study.runs import ProcessLock, plan_jobs
from ...world.errors import SimError
from .._episode_runner import EpisodeRunner
from .._files import templates_of
from ._evaluation import Evaluation
from ._settings import TuneSettings

_FOLDER: Final = "evaluations"


class PolicyEvaluator:
    """Evaluates policies over seeds: every seed in every scenario.

    Args:
        settings: scenarios, planner and perception of the episodes.
        runner: runs the episodes.
        folder: folder of the tuning, where the records are kept.
    """

    def __init__(self, settings: TuneSettings, runner: EpisodeRunner, folder: Path) -> None:
        self._settings = settings
        self._runner = runner
        self._folder = folder
        self._templates = templates_of(settings.scenarios)

    def evaluate(self, name: str, policy: AwarenessPolicy, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a policy, from files if this or another process has run it.

        Args:
            name: name of the policy, unique in the tuning.
            policy: the policy.
            seeds: consecutive seeds.
        """
        path = self._folder / _FOLDER / f"{name}-{seeds[0]}-{seeds[-1]}.csv"
        with ProcessLock(self._folder / "locks" / f"{path.stem}.lock"):
            if path.exists():
                return Evaluation.of(read_records(path))
            records = self._run(name, policy, seeds)
            if not any(record.error for record in records):
                path.parent.mkdir(parents=True, exist_ok=True)
                write_records(path, records)
            return Evaluation.of(records)

    def evaluate_all(self, name: str, policy: AwarenessPolicy, seeds: Sequence[int]) -> Evaluation:
        """Return the evaluation of a policy of which every episode has a result.

        Raises:
            SimError: an episode has none.
        """
        evaluation = self.evaluate(name, policy, seeds)
        if evaluation.errors:
            raise SimError(
                f"{len(evaluation.errors)} episodes of {name} have no result; the first: "
                f"{evaluation.errors[0]}"
            )
        return evaluation

    def _run(
        self, name: str, policy: AwarenessPolicy, seeds: Sequence[int]
    ) -> tuple[EpisodeRecord, ...]:
        return self._runner.run(
            plan_jobs(
                self._templates,
                [(name, policy)],
                seeds,
                planners=[self._settings.planner],
                perception=self._settings.perception,
            )
        )
