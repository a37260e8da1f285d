"""The command ``awarenav policy``."""

from __future__ import annotations

from typing import Any

from ..cli import NUMBER, FilePath, argument, command, group, option, options


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
    epilog="The presets are blind, conservative, balanced and assertive.",
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
    """Show a policy's effect for one person who stands straight ahead.

    Position and velocity are known exactly. Prints and draws obstacle radius and assumed human
    speed over awareness, and the speed limit over awareness and distance. Distances are from the
    robot's footprint (0.70 m × 0.50 m) to the person's body.
    """
    from ._show import ShowOptions, show_command  # noqa: PLC0415 - help needs no policies

    return show_command(ShowOptions(**values))


@command(
    "explore",
    short_help="Write a page with sliders for every setting.",
    examples=[
        "awarenav policy explore",
        "awarenav policy explore mine.yaml --robot robot.yaml --out mine.html",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="The presets are blind, conservative, balanced and assertive.",
)
@argument(
    "policy",
    default="balanced",
    metavar="[NAME|FILE]",
    shell_complete=options.COMPLETE_POLICIES,
    help="The policy that is shown first: a preset, or a YAML file.",
)
@option(
    "--robot",
    type=FilePath(),
    metavar="FILE",
    help="The robot that is shown first: a robot file, as `awarenav bridge` reads it.",
)
@options.out_file("explorer.html", "The page; replaces the file.", "FILE.html")
def explore(**values: Any) -> int:
    """Write one HTML page that shows what a policy does, with a slider for every setting.

    The page draws obstacle radius, speed limit, stopping distance and the reason of the limit for
    one person, and loads and saves policies as YAML. It gives what the adapter gives. It needs no
    network and no other file.
    """
    from ._explore import ExploreOptions, explore_command  # noqa: PLC0415 - help needs no policies

    return explore_command(ExploreOptions(**values))


policy.add_command(show)
policy.add_command(explore)
