"""The command ``awarenav frontier``: run the family of policies, then draw what it found."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from awarenav.errors import counted
from awarenav.files import json_text, write_text

from ...world.errors import SimError
from ..measures import EpisodeRecord
from ..runs import Conditions, RunFiles, policy_text, read_rows, run_jobs
from ._family import TODAY, family, sensors_of_today
from ._frontier import frontier_of
from ._show import draw_frontier, frontier_text


def frontier_command(
    folder: Path | None, conditions: Conditions, out: Path, *, as_json: bool, **running: Any
) -> int:
    """Run the family unless a folder of episodes is given, and write what it shows.

    Args:
        folder: of episodes; None to run the family.
        conditions: of the episodes to run.
        out: folder of the episodes to run.
        as_json: print the frontier as JSON.
        running: ``workers``, ``resume`` and ``overwrite`` of
            :func:`~sim_tests.study.runs.run_jobs`.

    Raises:
        SimError: an unusable option or folder, or no episode to compare.
    """
    failed = 0
    if folder is None:
        folder, records = out, _run(conditions, out, **running)
        failed = sum(bool(record.error) for record in records)
    else:
        records = read_rows(folder)
    frontier = frontier_of(records)
    text, data = frontier_text(frontier), json_text(asdict(frontier))
    write_text(folder / "frontier.md", text, SimError)
    write_text(folder / "frontier.json", data, SimError)
    for suffix in ("png", "svg"):
        draw_frontier(frontier, folder / f"frontier.{suffix}")
    if as_json:
        print(data, end="")
    else:
        print(text)
        print(f"Written to {folder}: frontier.png, frontier.svg, frontier.md, frontier.json")
    if failed:
        print(f"{counted(failed, 'episode')} failed; {RunFiles(folder).errors} has the tracebacks")
    return 1 if failed else 0


def _run(conditions: Conditions, out: Path, **running: Any) -> tuple[EpisodeRecord, ...]:
    """Run the family and today's AMR, and write the policies beside the episodes."""
    (sensors,) = conditions.sensors
    members = [(each.name, each.policy()) for each in family(memory="scanner" in sensors)]
    jobs = conditions.jobs(members)
    jobs += conditions.with_sensors(sensors_of_today(sensors)).jobs([TODAY])
    about = conditions.about("frontier", out)
    records = run_jobs(jobs, out, progress=True, about=about, **running)
    for name, policy in members:
        write_text(out / "policies" / f"{name}.yaml", policy_text(policy), SimError)
    return records
