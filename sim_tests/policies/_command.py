"""The command ``awarenav policy``."""

from __future__ import annotations

import argparse


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``policy`` to the commands."""
    policy = commands.add_parser(
        "policy",
        help="what a policy means in metres and metres a second",
        description="Look at awareness policies: presets, or YAML files of your own.",
    )
    actions = policy.add_subparsers(dest="action", required=True, metavar="ACTION")
    show = actions.add_parser(
        "show",
        help="table and drawing of radius and speed limit over awareness and distance",
        description="Print what policies mean for one person who stands straight ahead and is "
        "known exactly, and draw it: obstacle radius and assumed human speed over awareness, speed "
        "limit over awareness and distance. Distances run from the robot's footprint to the body.",
        epilog="Presets: blind, conservative, balanced, assertive. Exit status: 0 well, 2 bad "
        "input and nothing written. Needs matplotlib for the drawing, and no simulator.",
    )
    show.add_argument(
        "policies",
        nargs="+",
        metavar="FILE|NAME",
        help="policy YAML files or presets, drawn below each other",
    )
    show.add_argument(
        "--out",
        default="policy.png",
        metavar="FILE.png|svg|pdf|none",
        help="the drawing; a file that is there is replaced (default: policy.png)",
    )
    for option, default, what in (
        ("--max-speed", 1.5, "the robot's maximum, m/s"),
        ("--deceleration", 1.0, "braking that can be relied on, m/s²"),
        ("--reaction-time", 0.3, "until the robot brakes, s"),
        ("--farthest", 6.0, "end of the distance axis, m"),
    ):
        show.add_argument(
            option, type=float, default=default, metavar="X", help=f"{what} (default: {default:g})"
        )
    show.set_defaults(run=_show)


def _show(options: argparse.Namespace) -> int:
    from ._show import show_command  # noqa: PLC0415 - help needs no policies

    return show_command(options)
