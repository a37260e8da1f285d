"""The command ``awarenav frontier``: run the family of policies, then draw what it found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from awarenav.errors import counted
from awarenav.files import json_text, write_text

from ...world.errors import SimError
from ..measures import EpisodeRecord, read_rows
from ..runs import Conditions, RunFiles, policy_text, run_jobs
from ._family import TODAY, family, sensors_of_today
from ._frontier import frontier_of
from ._plot import draw_frontier
from ._text import frontier_text


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontierOptions:
    """The options of ``awarenav frontier``."""

    folder: Path | None
    conditions: Conditions
    workers: int | None
    out: Path
    resume: bool
    overwrite: bool
    as_json: bool


def frontier_command(options: FrontierOptions) -> int:
    """Run the family unless a folder of episodes is given, and write what it shows.

    Raises:
        SimError: an unusable option or folder, or no episode to compare.
    """
    failed = 0
    if options.folder is None:
        folder, records = options.out, _run(options)
        failed = sum(bool(record.error) for record in records)
    else:
        folder = options.folder
        records = read_rows(folder)
    frontier = frontier_of(records)
    text, data = frontier_text(frontier), json_text(asdict(frontier))
    write_text(folder / "frontier.md", text, SimError)
    write_text(folder / "frontier.json", data, SimError)
    for suffix in ("png", "svg"):
        draw_frontier(frontier, folder / f"frontier.{suffix}")
    if options.as_json:
        print(data, end="")
    else:
        print(text)
        print(f"Written to {folder}: frontier.png, frontier.svg, frontier.md, frontier.json")
    if failed:
        print(f"{counted(failed, 'episode')} failed; {RunFiles(folder).errors} has the tracebacks")
    return 1 if failed else 0


def _run(options: FrontierOptions) -> Iterable[EpisodeRecord]:
    """Run the family and today's AMR, and write the policies beside the episodes."""
    conditions = options.conditions
    (sensors,) = conditions.sensors
    members = [(each.name, each.policy()) for each in family(memory="scanner" in sensors)]
    jobs = conditions.jobs(members)
    jobs += conditions.with_sensors(sensors_of_today(sensors)).jobs([TODAY])
    records = run_jobs(
        jobs,
        options.out,
        workers=options.workers,
        resume=options.resume,
        overwrite=options.overwrite,
        progress=True,
        about=conditions.about("frontier", options.out),
    )
    for name, policy in members:
        path = options.out / "policies" / f"{name}.yaml"
        write_text(path, policy_text(policy), SimError)
    return records
