"""The command ``awarenav policy``."""

from __future__ import annotations

from pathlib import Path

from ..cli import FilePath, argument, command, group, option, options


@group("policy")
def policy() -> None:
    """Show awareness policies."""


@command(
    "show",
    short_help="Print and draw radius, human speed and speed limit.",
    examples=[
        "awarenav policy show balanced",
        "awarenav policy show blind balanced mine.yaml --robot robot.yaml --out mine.svg",
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
@options.plot_file("policy.png", "The drawing.")
@option("--overwrite", is_flag=True, help="Replace the drawing; without it, one is refused.")
@options.as_json()
@option(
    "--robot",
    type=FilePath(),
    show_default="0.70 m × 0.50 m",
    metavar="FILE",
    help="A robot file, as `awarenav bridge` reads it.",
)
def show(
    policies: tuple[str, ...],
    out: Path | None,
    robot: Path | None,
    *,
    overwrite: bool,
    as_json: bool,
) -> int:
    """Show a policy's effect for one person standing ahead of the robot or beside its path.

    Prints and draws the obstacle radius and U, the speed that the person may change to, over
    awareness, and the speed limit over awareness and distance. The robot drives straight on. The
    person beside the path stands 1.2 m from its centre line. Distances are along the path, from
    the robot's front to the body. Frames have shown the person for a while, at a known position.
    """
    from ._show import show_command  # noqa: PLC0415 - help needs no policies

    return show_command(policies, out, robot, overwrite=overwrite, as_json=as_json)


policy.add_command(show)
