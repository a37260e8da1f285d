"""The evaluation of a policy over the seeds of a tuning."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...scenario import ScenarioTemplate
from ...study.measures import EpisodeRecord, read_records, write_records
from ...world.errors import SimError
from .._episode_runner import EpisodeRunner
from .._process_lock import ProcessLock
from ._evaluation import Evaluation
from ._race import stages
from ._settings import TuneSettings

_FOLDER: Final = "evaluations"


class PolicyEvaluator:
    """Evaluates policies over seeds: every seed in every one of some scenarios.

    Args:
        settings: planner and perception of the episodes.
        runner: runs the episodes.
        folder: folder of the tuning, where the records are kept.
    """

    def __init__(self, settings: TuneSettings, runner: EpisodeRunner, folder: Path) -> None:
        self._settings = settings
        self._runner = runner
        self._folder = folder

    def evaluate(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: Sequence[int],
        templates: Sequence[ScenarioTemplate],
    ) -> Evaluation:
        """Return the evaluation of a policy, from files if this or another process has run it.

        Args:
            name: name of the policy, unique in the tuning.
            policy: the policy.
            seeds: consecutive seeds.
            templates: scenarios, always the same with the same seeds.
        """
        path = self._folder / _FOLDER / f"{name}-{seeds[0]}-{seeds[-1]}.csv"
        with ProcessLock(self._folder / "locks" / f"{path.stem}.lock"):
            if path.exists():
                return Evaluation.of(self._kept_records(path, name, seeds, len(templates)))
            records = self._run(name, policy, seeds, templates)
            if not any(record.error for record in records):
                path.parent.mkdir(parents=True, exist_ok=True)
                write_records(path, records)
            return Evaluation.of(records)

    def evaluate_all(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: range,
        templates: Sequence[ScenarioTemplate],
    ) -> Evaluation:
        """Return the evaluation of a policy of which every episode has a result.

        Raises:
            SimError: an episode has none.
        """
        parts = [self.evaluate(name, policy, part, templates) for part in stages(seeds)]
        evaluation = Evaluation.joined(parts)
        if evaluation.errors:
            raise SimError(
                f"{counted(len(evaluation.errors), 'episode')} of {name} without a result; the "
                f"first: {evaluation.errors[0]}"
            )
        return evaluation

    def _kept_records(
        self, path: Path, name: str, seeds: Sequence[int], scenarios: int
    ) -> tuple[EpisodeRecord, ...]:
        """Return the records of a file; raise SimError for one of other episodes."""
        records = read_records(path)
        episodes = {(record.scenario, record.seed) for record in records}
        if len(records) == len(episodes) == len(seeds) * scenarios and all(
            record.policy == name and record.seed in seeds for record in records
        ):
            return records
        raise SimError(
            f"{path} holds other episodes than those of {name}: move it away, and they run again"
        )

    def _run(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: Sequence[int],
        templates: Sequence[ScenarioTemplate],
    ) -> tuple[EpisodeRecord, ...]:
        return self._runner.run(self._settings.jobs(name, policy, seeds, templates))
