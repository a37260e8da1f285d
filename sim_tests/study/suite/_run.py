"""The episodes of the test suite: planned at collection, run by the first test."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from nav_adapter import NavError

from ...world.errors import SimError
from ..measures import nondeterminism_notes
from ..runs import Job, JobKey, describe, job_key, plan_jobs, run_jobs, template_of
from ._thresholds import Thresholds

_PLAN = pytest.StashKey["SuitePlan"]()


@dataclass(frozen=True, slots=True)
class SuitePlan:
    """The options of the test suite.

    Attributes:
        jobs: every episode.
        thresholds: thresholds of the episodes.
        workers: number of processes, None for one per core.
        out: folder for the results.
    """

    jobs: tuple[Job, ...]
    thresholds: Thresholds
    workers: int | None
    out: Path

    @classmethod
    def of(cls, config: pytest.Config) -> SuitePlan:
        """Read the options; raise SimError or NavError for an unusable one."""

        def option(name: str) -> str:
            return str(config.getoption(f"--awarenav-{name}"))

        first, episodes = (
            _whole_number("seed", option("seed"), 0),
            _whole_number("episodes", option("episodes")),
        )
        jobs = plan_jobs(
            config.getoption("--awarenav-scenario") or ["all"],
            [option("policy")],
            range(first, first + episodes),
            planners=[option("planner")],
            perception=option("perception"),
            sensors=[option("sensors")],
            faults=[option("fault")],
            camera=option("camera"),
            robot=option("robot"),
            population=option("population"),
        )
        file, workers = option("thresholds"), option("workers")
        thresholds = Thresholds.from_yaml(file) if file else Thresholds()
        known = {name for job in jobs for name in template_of(job.scenario).names}
        for name in thresholds.scenarios:
            if name not in known and config.getoption("--awarenav-scenario") == []:
                raise SimError(f"{file}: scenarios: there is no scenario {name!r}")
        return cls(
            jobs,
            thresholds,
            _whole_number("workers", workers) if workers else None,
            Path(option("out")),
        )

    def name(self, number: int) -> str:
        """Return the name of an episode's test."""
        key = job_key(self.jobs[number])
        return f"{key.scenario}-{key.seed}"


class SuiteRun:
    """The records of the episodes that the selected tests need; making it runs them.

    Args:
        plan: the plan of all episodes.
        wanted: numbers of the episodes to run.
    """

    def __init__(self, plan: SuitePlan, wanted: Sequence[int]) -> None:
        self._plan = plan
        self._row = {number: row for row, number in enumerate(sorted(set(wanted)))}
        jobs = [plan.jobs[number] for number in self._row]
        self._records = run_jobs(
            jobs, plan.out, workers=plan.workers, progress=True, overwrite=True
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences about the planner that pytest prints at its end."""
        return nondeterminism_notes(self._records)

    def verdict(self, number: int) -> str:
        """Return why an episode fails and how to replay it; empty when it passes."""
        job, record = self._plan.jobs[number], self._records[self._row[number]]
        key = job_key(job)
        names = template_of(job.scenario).names
        failures = list(self._plan.thresholds.of(*names).failures(record))
        return "\n".join(self._lines(failures, key, number)) if failures else ""

    def overall(self) -> str:
        """Return why all episodes together fail; empty when they pass."""
        failures = list(self._plan.thresholds.failures(self._records))
        if not failures:
            return ""
        failed = [
            f"  not a success: {describe(job_key(self._plan.jobs[number]))}\n"
            f"    {self._replay(number)}"
            for number in self._row
            if not self._records[self._row[number]].success
        ]
        return "\n".join([*failures, *failed])

    def _lines(self, failures: Sequence[str], key: JobKey, number: int) -> Iterator[str]:
        yield f"{'; '.join(failures)} ({describe(key)})"
        yield f"  {self._replay(number)}"

    def _replay(self, number: int) -> str:
        return shlex.join(["awarenav", "replay", str(self._plan.out), str(self._row[number])])


def planned(config: pytest.Config) -> SuitePlan:
    """Return the plan of this pytest run; an unusable option is a collection error."""
    if _PLAN not in config.stash:
        try:
            config.stash[_PLAN] = SuitePlan.of(config)
        except (SimError, NavError) as error:
            raise pytest.Collector.CollectError(f"awarenav: {error}") from error
    return config.stash[_PLAN]


def _whole_number(name: str, text: str, least: int = 1) -> int:
    if not text.isdecimal() or int(text) < least:
        raise SimError(f"--awarenav-{name} must be a whole number of at least {least}, got {text}")
    return int(text)
