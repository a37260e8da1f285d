"""What a tuning was asked for.

Runs a policy over the seeds of a tuning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from nav_adapter import AwarenessPolicy

from ...scenario import ScenarioTemplate
from ...study.measures import EpisodeRecord, read_records, write_records
from ...study.runs import plan_jobs
from ...world.errors import SimError
from .._crew import Crew
from .._file_lock import FileLock
from ._evaluation import Evaluation

#: Held-out seeds begin so far after the tuning ones.
HELD_OUT_FROM: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class TuneSettings:
    """What a tuning was asked for.

    Attributes:
        policy_name: what tables call the base policy.
        policy: YAML of the base policy.
        scenarios: YAML of the templates.
        ranges: where to search, by place in the policy.
        trials: policies to try.
        episodes: tuning seeds, each run in every scenario.
        held_out: held-out seeds, each run in every scenario.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: the first tuning seed, and of the sampler.
        sampler: ``"tpe"`` or ``"nsga2"``.
        generation: trials a generation.
    """

    policy_name: str
    policy: str
    scenarios: tuple[str, ...]
    ranges: dict[str, dict[str, Any]]
    trials: int
    episodes: int
    held_out: int
    perception: str
    planner: str
    seed: int
    sampler: str
    generation: int

    @property
    def tuning_seeds(self) -> range:
        """Seeds that trials are judged by."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def held_out_seeds(self) -> range:
        """Seeds that no trial has met; disjoint from the tuning seeds."""
        first = self.seed + HELD_OUT_FROM
        return range(first, first + self.held_out)


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
