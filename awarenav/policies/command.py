"""The command ``awarenav policy``."""

from __future__ import annotations

from typing import Any

from ..cli import argument, command, group, option, options


@group("policy")
def policy() -> None:
    """Show awareness policies: presets, or YAML files of your own."""


@command(
    "show",
    short_help="Table and drawing of radius, assumed human speed and speed limit.",
    epilog="Presets: blind, conservative, balanced, assertive. Exit status: 0 success; 2 bad "
    "input, nothing written. The drawing needs matplotlib.",
)
@argument("policies", nargs=-1, required=True, metavar="NAME|FILE...", help="Presets or files.")
@options.out_file(
    "policy.png", "The drawing; an existing file is replaced.", metavar="FILE.png|svg|pdf|none"
)
@options.as_json()
@option("--max-speed", type=float, default=1.5, metavar="M/S", help="The robot's maximum speed.")
@option(
    "--deceleration", type=float, default=1.0, metavar="M/S²", help="Braking that can be relied on."
)
@option(
    "--reaction-time", type=float, default=0.3, metavar="S", help="Time until the robot brakes."
)
@option("--farthest", type=float, default=6.0, metavar="M", help="End of the distance axis.")
def show(**values: Any) -> int:
    """Show what policies mean for one person who stands straight ahead and is known exactly.

    Prints and draws obstacle radius and assumed human speed over awareness, and the speed limit
    over awareness and distance. Distances run from the robot's footprint to the body.
    """
    from ._show import ShowOptions, show_command  # noqa: PLC0415 - help needs no policies

    return show_command(ShowOptions(**values))


policy.add_command(show)
