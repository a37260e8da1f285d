"""The command ``awarenav crossings``: run episodes, print a table, write the report."""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from awarenav.errors import counted
from awarenav.files import json_text
from perception import AwarenessPipeline, Camera

from ..conditions import Experiment
from ..world.errors import SimError
from .measures import nondeterminism_notes, short_text, summarise
from .runs import RunFiles, about_run, experiment_jobs, run_jobs, sample_jobs


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossingsOptions:
    """The options of ``awarenav crossings``."""

    experiment: Experiment
    sample: int | None
    workers: int | None
    scheduler: str | None
    time_limit: float | None
    out: Path
    resume: bool
    overwrite: bool
    no_report: bool
    as_json: bool


def crossings_command(options: CrossingsOptions) -> int:
    """Run episodes, print a short table, write the report.

    All errors are raised before anything runs.

    Raises:
        SimError: an unknown or unusable option.
        NavError: an unknown preset or unusable policy file.
        PerceptionError: for pixels, the shipped networks cannot be loaded.
    """
    experiment = options.experiment
    jobs = experiment_jobs(experiment)
    if experiment["perception"] == "pixels" and set(experiment["sensors"]) != {"scanner"}:
        # Refuses missing networks before anything runs.
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0))
    if options.sample is not None:
        jobs = sample_jobs(jobs, options.sample, experiment["seed"])
    records = run_jobs(
        jobs,
        options.out,
        workers=options.workers,
        scheduler=options.scheduler,
        time_limit_s=options.time_limit,
        resume=options.resume,
        overwrite=options.overwrite,
        progress=True,
        about=about_run(experiment, "crossings", options.out, sample=options.sample),
    )
    summary = summarise(records)
    if options.as_json:
        print(json_text([asdict(row) for row in summary.policies]), end="")
    else:
        print(short_text(summary))
        print(f"\nWritten to {options.out}: episodes.csv with {counted(len(records), 'episode')}")
    for note in nondeterminism_notes(records):
        print(note, file=sys.stderr)
    failed = [number for number, record in enumerate(records) if record.error]
    if failed:
        first = records[failed[0]]
        print(
            f"{len(failed)} of {counted(len(records), 'episode')} failed; episode {failed[0]} "
            f"({first.scenario}, seed {first.seed}): {first.error}\n"
            f"{RunFiles(options.out).errors} has the tracebacks",
            file=sys.stderr,
        )
    if not options.no_report:
        _write_report(options.out, as_json=options.as_json)
    return 1 if failed else 0


def _write_report(out: Path, *, as_json: bool) -> None:
    try:
        from .report import write_report  # noqa: PLC0415 - needs the extra bench

        path = write_report(out, progress=True)
    except SimError as error:  # the episodes are complete; the report can be made later
        print(f"no report: {error}; then: awarenav report {out}", file=sys.stderr)
        return
    print(f"Report: {path}", file=sys.stderr if as_json else sys.stdout)
