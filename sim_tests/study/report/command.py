"""The commands ``awarenav report`` and ``awarenav planners``."""

from __future__ import annotations

import inspect
import shlex
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from awarenav.cli import (
    FolderPath,
    Number,
    Seeds,
    argument,
    command,
    group,
    option,
    options,
    styled,
)

from ...conditions import REFERENCE_PLANNER, Experiment, conditions_options, option_words


@command(
    "report",
    examples=["awarenav report crossings"],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="docs/simulation.md explains the page. Needs the extra 'bench'; the images of the worst "
    "episodes also need the extra 'sim'.",
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@options.out_file(None, "The page.", "FILE.html", show_default="DIR/report.html")
@option("--no-stills", is_flag=True, help="Make no images of the worst episodes (faster).")
def report(folder: Path, out: Path | None, *, no_stills: bool) -> int:
    """Write report.html from the episodes.csv, jobs.jsonl and run.json of a run.

    The page shows contacts, margins and the time that awareness saves, with confidence intervals;
    every scenario and episode; and images of the worst episodes. It is one file that needs no
    network. The page of an unfinished run, or of one with failed episodes, says so.
    """
    from awarenav.files import check_output, require_writable  # noqa: PLC0415 - as below

    from ._write import write_report  # noqa: PLC0415 - help needs no statistics

    if out is not None:
        check_output(out, (".html",))
        require_writable(out.parent)
    path = write_report(folder, stills=not no_stills, path=out, progress=True)
    print(f"Written: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")
    return 0


@group("planners")
def planners() -> None:
    """List local planners, and compare yours with the reference planner."""


@command(
    "list",
    short_help="List the planners that have a name.",
    examples=["awarenav planners list --json"],
    exit_status={0: "Success."},
)
@options.as_json("the list")
def list_planners(*, as_json: bool) -> int:
    """List the planners that have a name; any other is given as module:NAME."""
    from awarenav.files import json_text  # noqa: PLC0415 - help needs no planners

    from ...crossing.planner import KNOWN_PLANNERS, ReferencePlanner  # noqa: PLC0415

    sentences = {
        name: (inspect.getdoc(make) or "").partition("\n")[0].removeprefix("Return ")
        for name, make in {REFERENCE_PLANNER: ReferencePlanner, **KNOWN_PLANNERS}.items()
    }
    known = {name: text[:1].upper() + text[1:] for name, text in sentences.items()}
    if as_json:
        print(json_text([{"name": name, "about": about} for name, about in known.items()]), end="")
        return 0
    for name, about in known.items():
        print(
            f"{styled(name, bold=True)}\n    {textwrap.fill(about, 76, subsequent_indent='    ')}"
        )
    print("\nA planner of yours: module:NAME, a class, a function that returns one, or an object.")
    return 0


@command(
    "compare",
    short_help="Compare planners: goals, seconds, margins, and whether they obey the limits.",
    examples=[
        "awarenav planners compare my_robot:MyPlanner --scenario busy_in_aisle",
        "awarenav planners compare my_robot:Dwa 'my_robot:Mppi(samples=500)' --seeds 20",
        "awarenav planners compare straight_on --scenario blind_corner --policy balanced --seeds 3",
    ],
    exit_status={
        0: "Success, whatever the figures.",
        1: "Some episodes failed; the page and DIR/errors.log say why.",
        2: "Bad input; nothing was run.",
        130: "Interrupted; the page shows the episodes so far.",
    },
    epilog="Writes report.html beside the files of a run of crossings. A killed or interrupted "
    "comparison continues with the same command and --resume. The page needs the extra 'bench'.",
)
@argument(
    "planners",
    nargs=-1,
    required=True,
    metavar="MODULE:NAME...",
    help="Classes, functions that return a planner, planners, or 'reference', 'costmap', "
    "'straight_on' and 'ros2'.",
)
@conditions_options(
    many=("scenario", "policy"),
    repeated=True,
    without=("planner", "fault", "seed"),
    perception={"default": "truth"},
)
@option(
    "--seeds",
    type=Seeds(),
    default="5",
    metavar="N|A-B",
    help="Seeds of the episodes of each scenario: 0 to N − 1, or A to B.",
)
@options.workers()
@option(
    "--time-limit",
    type=Number(1.0, 1e6),
    default=300.0,
    metavar="S",
    help="End an episode that takes longer than this in real time, for example because its planner "
    "hangs.",
)
@options.out_folder("planners")
@options.resume()
@options.overwrite()
@options.as_json("the figures")
def compare(
    planners: tuple[str, ...],
    out: Path,
    *,
    seeds: tuple[int, ...],
    time_limit: float,
    as_json: bool,
    **values: Any,
) -> int:
    """Compare local planners on the same crossings, and write one page about them.

    Each planner runs with every policy and with 'blind', and so does the reference planner. A probe
    with wider radii follows.
    """
    from awarenav.errors import counted  # noqa: PLC0415 - help needs no simulator

    from ..runs import RunFiles  # noqa: PLC0415
    from ._compare import compare_planners, print_comparison  # noqa: PLC0415

    experiment = Experiment.taken_from(values)
    records = compare_planners(
        planners,
        experiment["scenario"],
        out,
        policies=experiment["policy"],
        seeds=seeds,
        perception=experiment["perception"],
        sensors=experiment.one("sensors"),
        time_limit_s=time_limit,
        progress=True,
        about={"command": command_line(planners, seeds, experiment, out)},
        **experiment.changes,
        **values,
    )
    print_comparison(out, as_json=as_json)
    failed = sum(bool(each.error) for each in records)
    if failed:
        print(
            f"{failed} of {counted(len(records), 'episode')} failed; {RunFiles(out).errors} has "
            "the tracebacks",
            file=sys.stderr,
        )
    return 1 if failed else 0


def command_line(
    planners: Sequence[str], seeds: Sequence[int], experiment: Experiment, out: Path
) -> str:
    """Return the command line that makes the same comparison."""
    settings = experiment.settings()
    words = ["awarenav", "planners", "compare", *planners]
    for name in ("scenario", "policy"):
        words += [word for each in settings.pop(name) for word in (f"--{name}", each)]
    del settings["episodes"]
    words += ["--seeds", f"{seeds[0]}-{seeds[-1]}", *option_words(settings), "--out", str(out)]
    return shlex.join(words)


for _command in (list_planners, compare):
    planners.add_command(_command)
