"""The command ``awarenav planners``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import Number, Seeds, argument, command, group, option, options


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
    from ._list import list_command  # noqa: PLC0415 - help needs no planners

    return list_command(as_json=as_json)


@command(
    "compare",
    short_help="Compare planners: goals, seconds, margins, and whether they obey the limits.",
    examples=[
        "awarenav planners compare my_robot:MyPlanner --scenario busy_in_aisle",
        "awarenav planners compare my_robot:Dwa 'my_robot:Mppi(samples=500)' --seeds 20",
        "awarenav planners compare straight_on --scenario blind_corner --policy balanced --seeds 3",
    ],
    exit_status={
        0: "Success, whatever the verdicts.",
        1: "Some episodes failed; the page and DIR/errors.log say why.",
        2: "Bad input; nothing was run.",
        130: "Interrupted; the page shows the episodes so far.",
    },
    epilog="Writes scorecard.html, scorecard.md, scorecard.csv and scorecard.json beside the files "
    "of a run of crossings. A killed or interrupted comparison continues with the same command and "
    "--resume. The page needs the extra 'bench'.",
)
@argument(
    "planners",
    nargs=-1,
    required=True,
    metavar="MODULE:NAME...",
    help="Classes, functions that return a planner, planners, or 'reference', 'costmap' and "
    "'straight_on'.",
)
@options.scenarios("that have a planner", repeated=True)
@options.policies(["balanced"], repeated=True)
@option(
    "--seeds",
    type=Seeds(),
    default="5",
    metavar="N|A-B",
    help="Seeds of the episodes of each scenario: 0 to N − 1, or A to B.",
)
@options.perception(default="truth")
@options.sensors()
@options.camera()
@options.robot()
@options.population()
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
@options.as_json("the scorecard")
def compare(**values: Any) -> int:
    """Compare local planners on the same crossings, and write one page about them.

    Each planner runs with every policy and with 'blind', and so does the reference planner. Two
    probes follow: wider radii, and the speed field for planners that accept use_speed_field.
    """
    from ._compare import CompareOptions, compare_command  # noqa: PLC0415 - help needs no simulator

    return compare_command(CompareOptions(**values))


for _command in (list_planners, compare):
    planners.add_command(_command)
