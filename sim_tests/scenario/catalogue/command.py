"""Subcommands of ``awarenav scenario``: list, show and draw."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from awarenav.cli import argument, command, option, options


@command(
    "list",
    short_help="List the shipped scenarios.",
    examples=["awarenav scenario list --json"],
    exit_status={0: "Success."},
)
@options.as_json("the list")
def list_scenarios(*, as_json: bool) -> int:
    """List the shipped scenarios.

    Shows name and version, whether the people notice the robot, the number of people, the number of
    values that vary, and what happens.
    """
    from ._show import list_command  # noqa: PLC0415 - help needs no scenarios

    return list_command(as_json=as_json)


@command(
    "show",
    short_help="Describe a scenario, or print it as YAML.",
    examples=[
        "awarenav scenario show blind_corner",
        "awarenav scenario show crossing_from_left --yaml > mine.yaml",
    ],
    exit_status={0: "Success.", 2: "Bad input."},
)
@argument(
    "scenario",
    metavar="NAME|FILE",
    shell_complete=options.COMPLETE_SCENARIOS,
    help="A shipped scenario, or a YAML file.",
)
@option("--yaml", is_flag=True, help="Print YAML instead, with the shared defaults written out.")
@options.seed(" With --yaml: print the scenario of the episode with this seed.", default=None)
def show(scenario: str, *, yaml: bool, seed: int | None) -> int:
    """Describe what happens in a scenario and what varies.

    Also prints how often robot and people would meet if nobody reacted.
    """
    from ._show import show_command  # noqa: PLC0415 - help needs no scenarios

    return show_command(scenario, yaml=yaml, seed=seed)


@command(
    "draw",
    short_help="Draw scenarios from above.",
    examples=[
        "awarenav scenario draw crossing_from_left --out left.svg",
        "awarenav scenario draw all --out drawings",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="The drawing needs matplotlib.",
)
@argument(
    "scenarios",
    nargs=-1,
    required=True,
    metavar="NAME|FILE...",
    shell_complete=options.COMPLETE_SCENARIOS,
    help="Shipped scenarios, YAML files, or 'all' shipped ones.",
)
@options.out_file(
    "scenario.png",
    "The drawing; for several scenarios a folder, which gets a PNG of each.",
    "FILE.png|svg|pdf|DIR",
)
def draw(scenarios: tuple[str, ...], out: Path) -> int:
    """Draw scenarios from above: hall, paths with times, and gaze.

    Values that vary are at their medians; thin lines are the paths of other episodes. Dots are 2 s
    apart; sectors show the directions of gaze. Robot and people stand where they are 1.5 s before
    they come nearest to each other.
    """
    from ._show import draw_command  # noqa: PLC0415 - help needs no scenarios

    return draw_command(scenarios, str(out))


#: The subcommands of `awarenav scenario` that need no crossing.
COMMANDS: Final = (list_scenarios, show, draw)
