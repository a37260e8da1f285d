"""The plan of a run that is to be resumed, compared with the jobs that are asked for."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import asdict, dataclass
from pathlib import Path

from awarenav.line_files import DamagedLine
from perception.documents import read_lines

from ...world.errors import SimError
from ._job import Job
from ._run_files import JOB_FIELDS, job_line, parse_job


@dataclass(frozen=True, slots=True)
class ResumedPlan:
    """The content of ``jobs.jsonl``, compared with the jobs that are asked for.

    Attributes:
        lines: number of its lines.
        damaged: lines that are not jobs.
        doubtful: numbers of the jobs that no line confirms; empty if no line is damaged.
    """

    lines: int
    damaged: tuple[DamagedLine, ...]
    doubtful: Set[int]


def read_plan(path: Path, jobs: Sequence[Job]) -> ResumedPlan:
    """Compare ``jobs.jsonl`` with the jobs.

    Raises:
        SimError: a line that is not damaged is another job.
    """
    others: list[tuple[int, bytes]] = []
    confirmed, lines = set(), 0
    for number, line in enumerate(read_lines(path, SimError)):
        lines += 1
        if number < len(jobs) and line == job_line(jobs[number]).encode():
            confirmed.add(number)
        elif number < len(jobs) or others:  # more lines than jobs: their number says it
            others.append((number, line))
    damaged, moved = [], []
    for number, line in others:
        try:
            if not line.endswith(b"\n"):
                raise SimError(f"{path}, line {number + 1} has no end")
            moved.append((number, parse_job(line, f"{path}, line {number + 1}")))
        except SimError as cause:
            damaged.append(DamagedLine(number + 1, line.rstrip(b"\n"), str(cause)))
    numbers = {job: number for number, job in enumerate(jobs)} if others else {}
    for number, job in moved:
        # A damaged line end moves the lines behind it.
        if job not in numbers or not (damaged or numbers[job] == number):
            _refuse_other_plan(path, number, job, jobs)
        confirmed.add(numbers[job])
    doubtful = set(range(len(jobs))) - confirmed if damaged else set()
    return ResumedPlan(lines, tuple(damaged), doubtful)


def _refuse_other_plan(path: Path, number: int, job: Job, jobs: Sequence[Job]) -> None:
    """Raise SimError, naming the first field in which a line of ``path`` differs from a job."""
    before, now = asdict(job), asdict(jobs[min(number, len(jobs) - 1)])
    name = next((each for each in JOB_FIELDS if before[each] != now[each]), JOB_FIELDS[0])
    values = ""
    if "\n" not in f"{before[name]}{now[name]}":
        values = f" ({before[name]!r}, now {now[name]!r})"
    raise SimError(
        f"the run in {path.parent} has other episodes than these: episode {number} has another "
        f"{name}{values}; resume with the arguments that began it, which run.json holds, or run "
        "into another folder"
    )
