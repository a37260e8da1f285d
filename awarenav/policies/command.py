"""The command ``awarenav policy``."""

from __future__ import annotations

from typing import Any

from ..cli import NUMBER, argument, command, group, option, options


@group("policy")
def policy() -> None:
    """Show awareness policies: presets, or YAML files of yours."""


@command(
    "show",
    short_help="Print and draw radius, assumed human speed and speed limit.",
    examples=[
        "awarenav policy show balanced",
        "awarenav policy show blind balanced mine.yaml --max-speed 1.2 --out mine.svg",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="The presets are scanner, blind, conservative, balanced and assertive.",
)
@argument(
    "policies",
    nargs=-1,
    required=True,
    metavar="NAME|FILE...",
    shell_complete=options.COMPLETE_POLICIES,
    help="Presets, or YAML files.",
)
@options.plot_file("policy.png", "The drawing; replaces the file.")
@options.as_json()
@option("--max-speed", type=NUMBER, default=1.5, metavar="M/S", help="The robot's maximum speed.")
@option("--deceleration", type=NUMBER, default=1.0, metavar="M/S²", help="The robot's braking.")
@option(
    "--reaction-time", type=NUMBER, default=0.3, metavar="S", help="Time until the robot brakes."
)
@option("--farthest", type=NUMBER, default=6.0, metavar="M", help="End of the distance axis.")
def show(**values: Any) -> int:
    """Show a policy's effect for one person straight ahead whose position is known exactly.

    Prints and draws obstacle radius and assumed human speed over awareness, and the speed limit
    over awareness and distance. Distances are from the robot's footprint to the person's body.
    """
    from ._show import ShowOptions, show_command  # noqa: PLC0415 - help needs no policies

    return show_command(ShowOptions(**values))


policy.add_command(show)
