"""The command ``awarenav frontier``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, FolderPath, argument, command, option, options

from ...conditions import Experiment, conditions_options


@command(
    "frontier",
    examples=[
        "awarenav frontier --episodes 4 --sensors camera+scanner --out frontier",
        "awarenav frontier frontier",
        "awarenav frontier --scenario blind_corner --scenario runs_out --perception truth",
    ],
    exit_status={
        0: "Success.",
        1: "Some episodes failed; DIR/errors.log has the tracebacks.",
        2: "Bad input; nothing was run.",
        130: "Interrupted; the episodes so far are kept.",
    },
    epilog="A killed or interrupted run continues with the same command and --resume. "
    "docs/what_it_wins.md explains the picture. Needs the extra 'plot'.",
)
@argument(
    "folder",
    type=FolderPath(),
    required=False,
    metavar="[DIR]",
    help="Folder of finished episodes, to draw them again; nothing is run.",
)
@conditions_options(
    many=("scenario",),
    repeated=True,
    without=("policy", "fault"),
    seed={"note": " It is that of the first episode; the next ones count up."},
)
@option("--episodes", type=POSITIVE, default=1, metavar="N", help="Number of seeds per scenario.")
@options.workers()
@options.out_folder("frontier")
@options.resume()
@options.overwrite()
@options.as_json("the frontier")
def frontier(**values: Any) -> int:
    """Show what awareness is worth: time lost over step-out impacts.

    Runs `balanced` with other speeds U of unaware people, each without awareness, with it, and,
    with laser scanners, with a memory of 3 s; and today's AMR, the policy `scanner`. Writes
    frontier.png, frontier.svg, frontier.md and frontier.json, and the policies into DIR/policies.
    They say what awareness wins at equal risk and at equal time, with 95 % intervals. With DIR,
    the folder of such episodes, it runs nothing and draws them again.
    """
    from ._show import frontier_command  # noqa: PLC0415 - help needs no simulator

    return frontier_command(experiment=Experiment.taken_from(values), **values)
