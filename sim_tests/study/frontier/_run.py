"""The command ``awarenav frontier``: run the family of policies, then draw what it found."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from awarenav.errors import counted
from awarenav.files import json_text, write_text

from ...crossing.eyes import PerceptionKind, SensorSet
from ...world.errors import SimError
from ..measures import EpisodeRecord, read_rows
from ..runs import Job, RunFiles, plan_jobs, policy_text, run_jobs
from ._family import TODAY, family, sensors_of_today
from ._frontier import frontier_of
from ._plot import draw_frontier
from ._text import frontier_text


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontierOptions:
    """The options of ``awarenav frontier``."""

    folder: Path | None
    scenario: tuple[str, ...]
    planner: str
    perception: PerceptionKind
    sensors: SensorSet
    camera: str
    robot: str
    population: str | None
    episodes: int
    seed: int
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
    members = [(each.name, each.policy()) for each in family(memory="scanner" in options.sensors)]
    jobs = _jobs(options, members, options.sensors)
    jobs += _jobs(options, [TODAY], sensors_of_today(options.sensors))
    records = run_jobs(
        jobs,
        options.out,
        workers=options.workers,
        resume=options.resume,
        overwrite=options.overwrite,
        progress=True,
        about=_about(options),
    )
    for name, policy in members:
        path = options.out / "policies" / f"{name}.yaml"
        write_text(path, policy_text(policy), SimError)
    return records


def _jobs(options: FrontierOptions, policies: list[Any], sensors: SensorSet) -> tuple[Job, ...]:
    return plan_jobs(
        options.scenario,
        policies,
        range(options.seed, options.seed + options.episodes),
        planners=[options.planner],
        perception=options.perception,
        sensors=[sensors],
        camera=options.camera,
        robot=options.robot,
        population=options.population or "",
    )


def _about(options: FrontierOptions) -> dict[str, Any]:
    """Return the command and its settings for run.json; resuming a run gives the same."""
    settings: dict[str, Any] = {
        "scenario": list(options.scenario),
        "perception": options.perception,
        "sensors": options.sensors,
        "episodes": options.episodes,
        "seed": options.seed,
    }
    for name in ("planner", "camera", "robot", "population"):
        if value := getattr(options, name):
            settings[name] = value
    words = ["awarenav", "frontier"]
    for name, value in settings.items():
        for each in value if isinstance(value, list) else [value]:
            words += [f"--{name}", str(each)]
    return {"command": shlex.join([*words, "--out", str(options.out)]), "settings": settings}
