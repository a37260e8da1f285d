"""The command ``awarenav crossings``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import POSITIVE, command, option, options


@command(
    "crossings",
    epilog="Exit status: 0 success; 1 some episodes failed (DIR/errors.log says how); 2 bad input, "
    "nothing run. A killed run continues with the same arguments and --resume. `awarenav replay "
    "DIR N` shows episode N; `awarenav compare DIR` prints more tables.",
)
@options.scenarios("that have a planner")
@options.policies(["blind", "balanced"])
@options.planners()
@options.perception()
@options.camera()
@options.faults()
@option("--episodes", type=POSITIVE, default=1, metavar="N", help="Seeds for each scenario.")
@options.seed("the first episode; the next ones count up")
@options.workers()
@option(
    "--scheduler",
    metavar="ADDRESS",
    help="Run on a Dask cluster: tcp://HOST:PORT, or 'local' for one of --workers processes.",
)
@option(
    "--time-limit",
    type=float,
    metavar="S",
    help="End an episode that takes longer by the clock, e.g. because its planner hangs "
    "(default: none).",
)
@options.out_folder("crossings")
@options.resume()
@option("--no-report", is_flag=True, help="Write no report.")
@options.as_json()
def crossings(**values: Any) -> int:
    """Run every scenario with every policy, planner and fault on the same seeds, in closed loop.

    A row is appended to episodes.csv as soon as an episode ends; at the end the rows are put in
    order and the report is written. An episode that fails says why in its row and costs no other.
    """
    from ._crossings import (  # noqa: PLC0415 - help needs no simulator
        CrossingsOptions,
        crossings_command,
    )

    return crossings_command(CrossingsOptions(**values))
