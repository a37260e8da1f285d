"""The command ``awarenav watch``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import FilePath, Number, Whole, argument, command, option, options


@command(
    "watch",
    examples=[
        "awarenav watch crossing_attentive",
        "awarenav watch blind_corner --seed 3 --policy blind --sensors camera+scanner",
        "awarenav watch late_glance --population recorded --robot delivery",
        "awarenav watch late_glance --port 8765 --wait 300 --out late_glance.html",
    ],
    exit_status={
        0: "The crossing has ended, whatever its outcome.",
        2: "Bad input; nothing was run.",
        130: "Interrupted.",
    },
    epilog="The page is served on this computer alone and makes no request to any other. It keeps "
    "all states after the end, so the crossing can then be scrubbed.",
)
@argument(
    "scenario",
    metavar="SCENARIO",
    shell_complete=options.COMPLETE_SCENARIOS,
    help="A shipped scenario, or a YAML file.",
)
@options.policy(simulated=True)
@options.planner()
@options.perception()
@options.sensors()
@options.camera()
@options.robot()
@options.population()
@option(
    "--fault",
    default="none",
    metavar="NAME|FILE",
    help="Fault: a shipped one, a YAML file, several joined by '+', or 'none'.",
)
@options.seed()
@option(
    "--speed",
    type=Number(0.1, 20.0),
    default=1.0,
    metavar="X",
    help="Simulated seconds per second. A computer that is slower than this sets its own pace.",
)
@option(
    "--port",
    type=Whole(0, 65535),
    default=0,
    show_default="any free one",
    metavar="N",
    help="Port of the page on 127.0.0.1.",
)
@option(
    "--wait",
    type=Number(0.0, 3600.0),
    default=30.0,
    metavar="S",
    help="Longest time to wait for somebody to open the page before the crossing starts.",
)
@option(
    "--out",
    type=FilePath(),
    show_default="none",
    metavar="FILE.html",
    help="Also write the crossing as a page that needs no server.",
)
@option("--no-camera", is_flag=True, help="Show no picture of the robot's camera (faster).")
@option("--no-browser", is_flag=True, help="Open no browser; print the address only.")
def watch(**values: Any) -> int:
    """Watch one crossing in the browser while it runs.

    Shows the hall from above and the robot's camera, with attention cones, tracks, scans and radii;
    and over time each person's α with its bound, the speed limit and what sets it.
    """
    from ..runs import Conditions  # noqa: PLC0415 - help needs no simulator
    from ._watch import watch_command  # noqa: PLC0415

    return watch_command(Conditions.taken_from(values), **values)
