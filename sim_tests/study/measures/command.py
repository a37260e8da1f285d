"""The command ``awarenav compare``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import NUMBER, FilePath, argument, command, option, options


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
