"""The comparison of planners as a function, and the command ``awarenav planners compare``."""

from __future__ import annotations

import contextlib
import shlex
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from awarenav.errors import counted
from awarenav.files import json_text, write_text
from nav_adapter import AwarenessPolicy

from ...crossing.eyes import PerceptionKind, SensorSet
from ...scenario import ScenarioTemplate
from ...world.errors import SimError
from ..measures import table_text
from ..runs import RunFiles, run_jobs
from ._plan import plan_comparison
from ._score import Scorecard
from ._scoring import read_scorecard
from ._tables import csv_text, markdown, rows
from ._verdict import verdicts


def compare_planners(
    planners: Iterable[str | type | Any],
    scenarios: Sequence[str | ScenarioTemplate],
    out_dir: Path | str,
    *,
    policies: Sequence[str | tuple[str, AwarenessPolicy]] = ("balanced",),
    seeds: Iterable[int] = range(5),
    perception: str = "truth",
    sensors: str = "camera",
    camera: str = "",
    robot: str = "",
    population: str = "",
    workers: int | None = 1,
    time_limit_s: float | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    about: dict[str, Any] | None = None,
) -> Scorecard:
    """Compare planners on the same crossings, and write their scorecard into a folder.

    Every planner runs each scenario with each seed and policy, and so do the reference planner and
    the policy ``blind``, which times are compared with. An episode whose planner raises an error,
    returns no command or exceeds the time limit fails alone.

    Args:
        planners: ``"module:NAME"`` (a class, a function that returns a planner, or a planner, with
            arguments as ``"module:NAME(gain=2.0)"``), ``"reference"``, ``"costmap"``,
            ``"straight_on"``, or a class or function that can be imported by its name.
        scenarios: templates, shipped names, YAML files, or ``"all"``.
        out_dir: folder of the results, which :func:`write_scorecard` and
            :class:`~sim_tests.study.runs.RunFiles` list.
        policies: presets, YAML files, ``"oracle"``, or pairs of a name and a policy.
        seeds: seeds of the episodes.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        sensors: ``"camera"``, ``"camera+scanner"`` or ``"scanner"``.
        camera: a shipped name or a YAML file that replaces each scenario's camera.
        robot: a shipped name or a YAML file of the robot that they are fitted to.
        population: habits of the people, as for ``run_crossing``; empty for each scenario's own.
        workers: number of processes; 1 runs in this process unless there is a time limit.
        time_limit_s: wall-clock limit of an episode, which ends planners that hang.
        resume: continue the comparison in the folder.
        overwrite: replace the one in the folder.
        progress: show progress on standard error.
        about: further entries of ``run.json``.

    Returns:
        The scorecard, with the failed episodes in it.

    Raises:
        SimError: an unusable argument or folder; nothing has run then.
        NavError: an unknown preset or unusable policy file.
    """
    folder = Path(out_dir)
    plan, jobs = plan_comparison(
        [each if isinstance(each, str) else _import_name(each) for each in planners],
        scenarios,
        policies,
        tuple(seeds),
        perception=perception,
        sensors=sensors,
        camera=camera,
        robot=robot,
        population=population,
    )
    try:
        run_jobs(
            jobs,
            folder,
            workers=workers,
            time_limit_s=time_limit_s,
            resume=resume,
            overwrite=overwrite,
            progress=progress,
            about={**(about or {}), **plan.about()},
        )
    except KeyboardInterrupt:
        with contextlib.suppress(SimError):  # nothing has run yet
            write_scorecard(folder)
        raise
    return write_scorecard(folder)


def write_scorecard(folder: Path) -> Scorecard:
    """Write the page and the tables of a comparison, finished or not; return its scorecard.

    The files are ``scorecard.md``, ``scorecard.csv``, ``scorecard.json`` and, with the extra
    ``bench``, ``scorecard.html``.

    Raises:
        SimError: the folder holds no comparison, or a table cannot be written.
    """
    card = read_scorecard(folder)
    write_text(folder / "scorecard.md", markdown(card), SimError)
    write_text(folder / "scorecard.csv", csv_text(card), SimError)
    write_text(folder / "scorecard.json", json_text(asdict(card)), SimError)
    try:
        from ._page import write_page_of  # noqa: PLC0415 - needs the extra bench

        write_page_of(card, folder)
    except SimError as error:  # the tables are complete
        print(f"no page: {error}", file=sys.stderr)
    return card


def _import_name(planner: Any) -> str:
    """Return ``module:NAME`` of a class or function; raise SimError for anything without one."""
    module, name = getattr(planner, "__module__", None), getattr(planner, "__qualname__", "")
    if not module or not name or "<" in name:
        raise SimError(
            "a planner must be given as module:NAME, or as a class or function that can be "
            f"imported by its name, got {planner!r:.80}"
        )
    return f"{module}:{name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareOptions:
    """The options of ``awarenav planners compare``."""

    planners: tuple[str, ...]
    scenario: tuple[str, ...]
    policy: tuple[str, ...]
    seeds: tuple[int, ...]
    perception: PerceptionKind
    sensors: SensorSet
    camera: str
    robot: str
    population: str | None
    workers: int | None
    time_limit: float
    out: Path
    resume: bool
    overwrite: bool
    as_json: bool


def compare_command(options: CompareOptions) -> int:
    """Compare planners, print verdicts and a table, and return the exit status.

    Raises:
        SimError: an unknown or unusable option.
        NavError: an unknown preset or unusable policy file.
    """
    card = compare_planners(
        options.planners,
        options.scenario,
        options.out,
        policies=options.policy,
        seeds=options.seeds,
        perception=options.perception,
        sensors=options.sensors,
        camera=options.camera,
        robot=options.robot,
        population=options.population or "",
        workers=options.workers,
        time_limit_s=options.time_limit,
        resume=options.resume,
        overwrite=options.overwrite,
        progress=True,
        about={"command": _command_line(options)},
    )
    if options.as_json:
        print(json_text(asdict(card)), end="")
    else:
        for verdict in verdicts(card):
            print(f"{verdict.name}: {verdict.text}\n")
        print(_short_table(card))
        print(f"\nWritten to {options.out}: scorecard.html, .md, .csv and .json")
    failed = sum(each.times for planner in card.planners for each in planner.failures)
    if failed:
        print(
            f"{failed} of {counted(card.episodes, 'episode')} failed; "
            f"{RunFiles(options.out).errors} has the tracebacks",
            file=sys.stderr,
        )
    return 1 if failed else 0


def _short_table(card: Scorecard) -> str:
    """Return the columns that fit on a terminal."""
    header = ("planner", "policy", "goals", "median s", "against blind s", "contacts", "margin m")
    kept = (0, 1, 2, 5, 6)
    lines = [
        (row.planner, row.policy, *(row.cells[column].text for column in kept))
        for row in rows(card)
    ]
    return table_text(header, lines, left=2)


def _command_line(options: CompareOptions) -> str:
    """Return the command line that makes the same comparison."""
    first, last = options.seeds[0], options.seeds[-1]
    words = ["awarenav", "planners", "compare", *options.planners]
    for name in ("scenario", "policy"):
        words += [word for each in getattr(options, name) for word in (f"--{name}", each)]
    words += ["--seeds", f"{first}-{last}", "--perception", options.perception]
    if options.sensors != "camera":
        words += ["--sensors", options.sensors]
    if options.camera:
        words += ["--camera", options.camera]
    if options.robot:
        words += ["--robot", options.robot]
    if options.population:
        words += ["--population", options.population]
    return shlex.join([*words, "--out", str(options.out)])
