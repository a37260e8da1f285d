"""The command ``awarenav crossings``: run episodes, print a table, write the report."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from awarenav.errors import counted
from awarenav.files import json_text
from perception import AwarenessPipeline, Camera

from ..conditions import Experiment
from ..world.errors import SimError
from .measures import nondeterminism_notes, short_text, summarise
from .runs import RunFiles, about_run, experiment_jobs, run_jobs, sample_jobs


def crossings_command(
    experiment: Experiment,
    *,
    out: Path,
    sample: int | None,
    time_limit: float | None,
    no_report: bool,
    as_json: bool,
    **running: Any,
) -> int:
    """Run episodes, print a short table, write the report.

    All errors are raised before anything runs.

    Args:
        experiment: the episodes.
        out: folder of the run.
        sample: number of episodes to draw; None for all.
        time_limit: of an episode, seconds; None for no limit.
        no_report: write no report.
        as_json: print the table as JSON.
        running: ``workers``, ``scheduler``, ``resume`` and ``overwrite`` of
            :func:`~sim_tests.study.runs.run_jobs`.

    Raises:
        SimError: an unknown or unusable option.
        NavError: an unknown preset or unusable policy file.
        PerceptionError: for pixels, the shipped networks cannot be loaded.
    """
    jobs = experiment_jobs(experiment)
    if experiment["perception"] == "pixels" and set(experiment["sensors"]) != {"scanner"}:
        # Refuses missing networks before anything runs.
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0))
    if sample is not None:
        jobs = sample_jobs(jobs, sample, experiment["seed"])
    records = run_jobs(
        jobs,
        out,
        time_limit_s=time_limit,
        progress=True,
        about=about_run(experiment, "crossings", out, sample=sample),
        **running,
    )
    summary = summarise(records)
    if as_json:
        print(json_text([asdict(row) for row in summary.policies]), end="")
    else:
        print(short_text(summary))
        print(f"\nWritten to {out}: episodes.csv with {counted(len(records), 'episode')}")
    for note in nondeterminism_notes(records):
        print(note, file=sys.stderr)
    failed = [number for number, record in enumerate(records) if record.error]
    if failed:
        first = records[failed[0]]
        print(
            f"{len(failed)} of {counted(len(records), 'episode')} failed; episode {failed[0]} "
            f"({first.scenario}, seed {first.seed}): {first.error}\n"
            f"{RunFiles(out).errors} has the tracebacks",
            file=sys.stderr,
        )
    if not no_report:
        _write_report(out, as_json=as_json)
    return 1 if failed else 0


def _write_report(out: Path, *, as_json: bool) -> None:
    try:
        from .report import write_report  # noqa: PLC0415 - needs the extra bench

        path = write_report(out, progress=True)
    except SimError as error:  # the episodes are complete; the report can be made later
        print(f"no report: {error}; then: awarenav report {out}", file=sys.stderr)
        return
    print(f"Report: {path}", file=sys.stderr if as_json else sys.stdout)
