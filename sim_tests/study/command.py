"""The commands ``awarenav crossings`` and ``awarenav compare``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import NUMBER, POSITIVE, FilePath, argument, command, option, options


@command(
    "crossings",
    examples=[
        "awarenav crossings --scenario blind_corner --policy blind balanced",
        "awarenav crossings --policy mine.yaml blind --episodes 20 --out run",
        "awarenav crossings --planner my_planners:Dwa reference --fault none ghosts",
        "awarenav crossings --robot forklift --scenario blind_corner head_on_in_aisle",
        "awarenav crossings --fault 'scanner_*' --sensors camera+scanner --sample 50",
    ],
    exit_status={
        0: "Success.",
        1: "Some episodes failed; DIR/errors.log has the tracebacks.",
        2: "Bad input; nothing was run.",
        130: "Interrupted; the episodes so far are kept.",
    },
    epilog="A killed or interrupted run continues with the same command and --resume. `awarenav "
    "replay DIR N` films episode N; `awarenav compare DIR` prints more tables.",
)
@options.scenarios("that have a planner")
@options.policies(["blind", "balanced"])
@options.planner(many=True)
@options.perception()
@options.sensors(many=True)
@options.camera()
@options.robot()
@options.population()
@options.faults()
@option("--episodes", type=POSITIVE, default=1, metavar="N", help="Number of seeds per scenario.")
@option(
    "--sample",
    type=POSITIVE,
    show_default="all",
    metavar="N",
    help="Run only N of all these episodes, drawn at random by --seed: each fault once before any "
    "twice, scenarios and policies equally often.",
)
@options.seed(" It is that of the first episode; the next ones count up.")
@options.workers()
@option(
    "--scheduler",
    metavar="ADDRESS",
    help="Run on a Dask cluster: tcp://HOST:PORT, or 'local' for a cluster of --workers processes "
    "on this computer.",
)
@option(
    "--time-limit",
    type=NUMBER,
    show_default="none",
    metavar="S",
    help="End an episode that takes longer than this in real time, for example because its planner "
    "hangs.",
)
@options.out_folder("crossings")
@options.resume()
@options.overwrite()
@option("--no-report", is_flag=True, help="Write no report.")
@options.as_json()
def crossings(**values: Any) -> int:
    """Run every scenario with every policy, planner and fault on the same seeds, in closed loop.

    Every episode that ends appends a row to episodes.csv. At the end the rows are sorted and the
    report is written. The row of a failed episode has the reason; the other episodes still run.
    """
    from ._crossings import (  # noqa: PLC0415 - help needs no simulator
        CrossingsOptions,
        crossings_command,
    )
    from .runs import Conditions  # noqa: PLC0415

    return crossings_command(CrossingsOptions(conditions=Conditions.taken_from(values), **values))


@command(
    "compare",
    examples=[
        "awarenav compare crossings",
        "awarenav compare monday tuesday --baseline balanced --out both.csv",
    ],
    exit_status={0: "Success.", 2: "Bad input."},
    epilog="docs/simulation.md defines every metric.",
)
@argument(
    "runs",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="DIR|FILE...",
    help="Folders of runs, or files episodes.csv or .parquet.",
)
@option("--baseline", default="blind", metavar="NAME", help="Policy to compare with.")
@option(
    "--level",
    type=NUMBER,
    default=0.95,
    metavar="X",
    help="Confidence level of the intervals, between 0 and 1.",
)
@options.seed(" They are those of the bootstrap.")
@options.out_file(None, "Also write the episodes of all runs into one file.", "FILE.csv|parquet")
@options.as_json("the summary")
def compare(**values: Any) -> int:
    """Print success, time lost, contacts and separation per policy, with confidence intervals.

    Compares every policy with the baseline on the same scenarios and seeds. A run may be
    unfinished.
    """
    from ._compare import compare_command  # noqa: PLC0415 - help needs no statistics

    return compare_command(**values)
