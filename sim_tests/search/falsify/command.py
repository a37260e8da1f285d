"""The command ``awarenav falsify``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, command, option, options


@command(
    "falsify",
    epilog="Killed or interrupted, the same command with --resume ends with the same result, with "
    "any number of --workers. Exit status: 0 no contact that the robot caused; 1 some; 2 bad "
    "input. Needs the extra 'bench'.",
)
@options.policy()
@options.scenarios("that have a planner and people")
@option(
    "--episodes",
    type=POSITIVE,
    default=2000,
    metavar="N",
    help="Episodes at least: half for all scenarios alike, the rest for the worst third.",
)
@option(
    "--generation",
    type=POSITIVE,
    default=12,
    metavar="N",
    help="Episodes in a generation of the search.",
)
@option(
    "--people",
    type=POSITIVE,
    default=2,
    metavar="N",
    help="How many people of a scenario are varied.",
)
@option("--worst", type=POSITIVE, default=10, metavar="N", help="Cases to write.")
@options.perception()
@options.camera()
@options.planner()
@option(
    "--unsafe-no-floor",
    is_flag=True,
    excludes="--planner",
    help="UNSAFE, in the simulation only: take the adapter's radii and speed limits away from the "
    "reference planner, to check that the search finds the effect.",
)
@options.seed("search and episodes")
@options.workers(1)
@options.out_folder("falsify")
@options.resume()
@options.as_json()
def falsify(**values: Any) -> int:
    """Search for the situations in which your policy does worst.

    Varies start, path, speed, pauses, gaze and reactions of a scenario's people, within human
    limits, for the smallest separation margin while the robot moves. Writes worst_001.yaml and so
    on, which `awarenav crossings --scenario` runs again, episodes.csv, falsify.png, summary.json
    and the studies.
    """
    from ._run import FalsifyOptions, falsify_command  # noqa: PLC0415 - help needs no simulator

    return falsify_command(FalsifyOptions(**values))
