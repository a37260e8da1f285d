"""The episodes behind the test-suite: planned at collection, run when the first test asks."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from nav_adapter import NavError

from ...world.errors import SimError
from ..runs import Job, JobKey, describe, job_key, plan_jobs, run_jobs
from ._thresholds import Thresholds


@dataclass(frozen=True, slots=True)
class SuitePlan:
    """What the options ask for.

    Attributes:
        jobs: every episode.
        thresholds: what they must hold.
        workers: processes, None for one a core.
        out: folder for the results.
    """

    jobs: tuple[Job, ...]
    thresholds: Thresholds
    workers: int | None
    out: Path

    @classmethod
    def of(cls, config: pytest.Config) -> SuitePlan:
        """Read the options; raises SimError or NavError for what cannot be used."""

        def option(name: str) -> str:
            return str(config.getoption(f"--awarenav-{name}"))

        first, episodes = _whole("seed", option("seed"), 0), _whole("episodes", option("episodes"))
        jobs = plan_jobs(
            config.getoption("--awarenav-scenario") or ["all"],
            [option("policy")],
            range(first, first + episodes),
            planners=[option("planner")],
            perception=option("perception"),
            faults=[option("fault")],
            camera=option("camera"),
        )
        file, workers = option("thresholds"), option("workers")
        thresholds = Thresholds.from_yaml(file) if file else Thresholds()
        known = {job_key(job).scenario for job in jobs}
        for name in thresholds.scenarios:
            if name not in known and config.getoption("--awarenav-scenario") == []:
                raise SimError(f"{file}: scenarios: there is no scenario {name!r}")
        return cls(
            jobs, thresholds, _whole("workers", workers) if workers else None, Path(option("out"))
        )

    def name(self, number: int) -> str:
        """Of an episode among the tests."""
        key = job_key(self.jobs[number])
        return f"{key.scenario}-{key.seed}"


class SuiteRun:
    """Runs the episodes that the chosen tests are about.

    Args:
        plan: of all of them.
        wanted: numbers of those to run.
    """

    def __init__(self, plan: SuitePlan, wanted: Sequence[int]) -> None:
        self._plan = plan
        self._place = {number: place for place, number in enumerate(sorted(set(wanted)))}
        jobs = [plan.jobs[number] for number in self._place]
        self._records = run_jobs(jobs, plan.out, workers=plan.workers, progress=True, afresh=True)

    def verdict(self, number: int) -> str:
        """Why an episode fails and how to see it again; empty when it passes."""
        job, record = self._plan.jobs[number], self._records[self._place[number]]
        key = job_key(job)
        failures = list(self._plan.thresholds.of(key.scenario).failures(record))
        return "\n".join(self._lines(failures, key, number)) if failures else ""

    def overall(self) -> str:
        """Why all together fail; empty when they pass."""
        failures = list(self._plan.thresholds.failures(self._records))
        if not failures:
            return ""
        worst = [
            f"  not a success: {describe(job_key(self._plan.jobs[number]))}\n"
            f"    {self._replay(number)}"
            for number in self._place
            if not self._records[self._place[number]].success
        ]
        return "\n".join([*failures, *worst])

    def _lines(self, failures: Sequence[str], key: JobKey, number: int) -> Iterator[str]:
        yield f"{'; '.join(failures)} ({describe(key)})"
        yield f"  {self._replay(number)}"

    def _replay(self, number: int) -> str:
        return shlex.join(["awarenav", "replay", str(self._plan.out), str(self._place[number])])


def planned(config: pytest.Config) -> SuitePlan:
    """The plan of this pytest run; what is wrong with the options is a collection error."""
    if _PLAN not in config.stash:
        try:
            config.stash[_PLAN] = SuitePlan.of(config)
        except (SimError, NavError) as error:
            raise pytest.Collector.CollectError(f"awarenav: {error}") from error
    return config.stash[_PLAN]


_PLAN = pytest.StashKey[SuitePlan]()


def _whole(name: str, text: str, least: int = 1) -> int:
    if not text.isdecimal() or int(text) < least:
        raise SimError(f"--awarenav-{name} must be a whole number of at least {least}, got {text}")
    return int(text)
