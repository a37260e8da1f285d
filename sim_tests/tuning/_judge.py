"""Runs a policy over the seeds of a tuning."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import yaml

from nav_adapter import AwarenessPolicy

from .._errors import SimError
from .._scenario_template import ScenarioTemplate
from ..measures._episode_record import EpisodeRecord
from ..measures._record_file import read_records, write_records
from ..runs._job import Job
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
        templates = [ScenarioTemplate.from_text(text) for text in settings.scenarios]
        self._scenarios: Callable[[int], Sequence[str]] = lambda seed: [
            scenario_text(template, seed) for template in templates
        ]

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
        text = policy_text(policy)
        settings = self._settings
        return self._crew.run(
            [
                Job(
                    scenario=scenario,
                    seed=seed,
                    policy_name=name,
                    policy=text,
                    planner=settings.planner,
                    perception=settings.perception,
                )
                for seed in seeds
                for scenario in self._scenarios(seed)
            ]
        )


def scenario_text(template: ScenarioTemplate, seed: int) -> str:
    """YAML of the scenario that a template gives for a seed."""
    scenario = template.for_seed(seed)
    return yaml.safe_dump(scenario.model_dump(mode="json"), sort_keys=False, allow_unicode=True)


def policy_text(policy: AwarenessPolicy) -> str:
    """YAML of a policy."""
    return yaml.safe_dump(policy.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
