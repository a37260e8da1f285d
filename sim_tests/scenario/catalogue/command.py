"""The command ``awarenav scenario``."""

from __future__ import annotations

from awarenav.cli import argument, command, group, option, options


@group("scenario")
def scenario() -> None:
    """List, explain, draw and check scenarios: shipped ones, or YAML files of your own."""


@command("list", short_help="List the shipped scenarios.")
@options.as_json("the list")
def list_scenarios(*, as_json: bool) -> int:
    """List the shipped scenarios.

    Shows name and version, who notices the robot, how many people there are, how many numbers vary,
    and what happens.
    """
    from ._show import list_command  # noqa: PLC0415 - help needs no scenarios

    return list_command(as_json=as_json)


@command(
    "show",
    short_help="Describe a scenario, or print it as YAML.",
    epilog="A file to start from: awarenav scenario show crossing_from_left --yaml > mine.yaml",
)
@argument("scenario", metavar="NAME|FILE", help="Shipped scenario, or YAML file.")
@option("--yaml", is_flag=True, help="Print YAML instead, with the shared defaults written out.")
@option(
    "--seed",
    type=int,
    metavar="N",
    help="With --yaml: the scenario of the episode with this seed, its numbers drawn.",
)
def show(scenario: str, *, yaml: bool, seed: int | None) -> int:
    """Describe what happens in a scenario and what varies in it.

    Also says how often robot and people would meet if nobody reacted.
    """
    from ._show import show_command  # noqa: PLC0415 - help needs no scenarios

    return show_command(scenario, yaml=yaml, seed=seed)


@command(
    "draw",
    short_help="Draw scenarios from above.",
    epilog="Exit status: 0 success; 2 bad input, nothing written.",
)
@argument(
    "scenarios",
    nargs=-1,
    required=True,
    metavar="NAME|FILE...",
    help="Scenarios, or 'all' shipped ones.",
)
@option(
    "--out",
    default="scenario.png",
    metavar="FILE.png|svg|pdf|DIR",
    help="The drawing; for several scenarios a folder, with a PNG for each.",
)
def draw(scenarios: tuple[str, ...], out: str) -> int:
    """Draw scenarios from above: hall, paths with times, and where people look.

    Numbers that vary are at their medians; thin lines are paths of other episodes. Dots are 2 s
    apart, sectors show where people look. Everybody stands where they would be 1.5 s before robot
    and people are nearest.
    """
    from ._show import draw_command  # noqa: PLC0415 - help needs no scenarios

    return draw_command(scenarios, out)


@command(
    "validate",
    short_help="Check scenario files.",
    epilog="Exit status: 0 all can be run; 2 one cannot.",
)
@argument("files", nargs=-1, required=True, metavar="NAME|FILE...", help="YAML files.")
def validate(files: tuple[str, ...]) -> int:
    """Check scenario files: keys and values over many draws, and whether anybody is in a rack.

    Also warns where robot and people would hardly ever meet if nobody reacted.
    """
    from ._show import validate_command  # noqa: PLC0415 - help needs no scenarios

    return validate_command(files)


for _each in (list_scenarios, show, draw, validate):
    scenario.add_command(_each)
