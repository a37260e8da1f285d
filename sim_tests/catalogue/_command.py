"""The command ``awarenav scenario``."""

from __future__ import annotations

import argparse


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``scenario`` to the commands."""
    scenario = commands.add_parser(
        "scenario",
        help="list, explain, draw and check scenarios",
        description="Look at the scenarios of closed-loop crossings: shipped ones by name, or YAML "
        "files of your own.",
    )
    actions = scenario.add_subparsers(dest="action", required=True, metavar="ACTION")

    listing = actions.add_parser(
        "list",
        help="what comes with the package",
        description="Print every shipped scenario: its name and version, who notices the robot, "
        "how many people there are, how many numbers vary, and what happens.",
    )
    listing.set_defaults(run=_list)

    show = actions.add_parser(
        "show",
        help="one scenario in detail, or as YAML to start from",
        description="Print what happens in a scenario, what varies in it, and how often robot and "
        "people would meet if nobody reacted.",
        epilog="awarenav scenario show crossing_from_left --yaml > mine.yaml",
    )
    show.add_argument("scenario", metavar="NAME|FILE", help="shipped scenario or YAML file")
    show.add_argument(
        "--yaml",
        action="store_true",
        help="print it as YAML instead, shared defaults written out",
    )
    show.add_argument(
        "--seed",
        type=int,
        metavar="N",
        help="with --yaml: the scenario of the episode with this seed, its numbers drawn",
    )
    show.set_defaults(run=_show)

    draw = actions.add_parser(
        "draw",
        help="a plan view: hall, ways with times, and where people look",
        description="Draw scenarios from above at the medians of what varies; thin lines are ways "
        "in other episodes, dots are 2 s apart, sectors show where people look. Everybody stands "
        "where they would be 1.5 s before robot and people are nearest.",
        epilog="Exit status: 0 well, 2 bad input and nothing written.",
    )
    draw.add_argument(
        "scenarios", nargs="+", metavar="NAME|FILE", help="scenarios, or 'all' shipped ones"
    )
    draw.add_argument(
        "--out",
        default="scenario.png",
        metavar="FILE.png|svg|pdf|DIR",
        help="the drawing; for several a folder, a PNG each (default: scenario.png)",
    )
    draw.set_defaults(run=_draw)

    validate = actions.add_parser(
        "validate",
        help="check files of your own",
        description="Check scenario files: keys and values, over many draws; that nobody stands in "
        "or walks through racks; and whether robot and people would meet if nobody reacted.",
        epilog="Exit status: 0 all can be run, 2 one cannot.",
    )
    validate.add_argument("files", nargs="+", metavar="NAME|FILE", help="YAML files")
    validate.set_defaults(run=_validate)


# Help needs no scenarios.
def _list(options: argparse.Namespace) -> int:
    from ._show import list_command  # noqa: PLC0415

    return list_command()


def _show(options: argparse.Namespace) -> int:
    from ._show import show_command  # noqa: PLC0415

    return show_command(options.scenario, yaml=options.yaml, seed=options.seed)


def _draw(options: argparse.Namespace) -> int:
    from ._show import draw_command  # noqa: PLC0415

    return draw_command(options.scenarios, options.out)


def _validate(options: argparse.Namespace) -> int:
    from ._show import validate_command  # noqa: PLC0415

    return validate_command(options.files)
