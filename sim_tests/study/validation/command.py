"""The command ``awarenav scenario``."""

from __future__ import annotations

from awarenav.cli import Whole, argument, command, group, option, options

from ...scenario.catalogue import command as catalogue


@group("scenario")
def scenario() -> None:
    """List, explain, draw and check scenarios: shipped ones, or YAML files of yours."""


@command(
    "validate",
    short_help="Check scenario files.",
    examples=["awarenav scenario validate mine.yaml"],
    exit_status={
        0: "All can be run.",
        1: "The people of one contradict its attention.",
        2: "One cannot be run.",
    },
)
@argument(
    "files",
    nargs=-1,
    required=True,
    metavar="NAME|FILE...",
    shell_complete=options.COMPLETE_SCENARIOS,
    help="YAML files, or shipped scenarios.",
)
@option(
    "--episodes",
    type=Whole(0),
    default=3,
    metavar="N",
    help="Crossings per scenario that measure what its people look at; 0 measures nothing.",
)
def validate(files: tuple[str, ...], *, episodes: int) -> int:
    """Check scenario files: keys, values over many draws, and that nobody stands in a rack.

    Runs a few crossings with perfect perception and checks `attention` against what people look
    at while the robot is in front of them within 5 m: `attentive` people are aware of it (α ≥ 0.5)
    for at least 80 % of that time, `unaware` people look straight at it (α ≥ 0.9) for at most 25 %.
    Also warns if robot and people would hardly ever meet if nobody reacted.
    """
    from ._run import validate_command  # noqa: PLC0415 - help needs no scenarios

    return validate_command(files, episodes)


for _command in (*catalogue.COMMANDS, validate):
    scenario.add_command(_command)
