"""The command ``awarenav compare``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import FilePath, argument, command, option, options


@command(
    "compare", epilog="docs/metrics.md defines every figure. Exit status: 0 success; 2 bad input."
)
@argument(
    "runs",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="DIR|FILE...",
    help="Folders with an episodes.csv, or such files, also as .parquet.",
)
@option("--baseline", default="blind", metavar="NAME", help="Policy that others are compared with.")
@option(
    "--level",
    type=float,
    default=0.95,
    metavar="X",
    help="Confidence of the intervals, between 0 and 1.",
)
@options.seed("the bootstrap")
@options.out_file(None, "Also write the episodes of all runs into one .csv or .parquet file.")
@options.as_json("the summary")
def compare(**values: Any) -> int:
    """Print success, time lost, contacts and separation of every policy, with intervals.

    Every policy is compared with the baseline on the same scenarios and seeds. A run may be
    unfinished.
    """
    from ._compare import CompareOptions, compare_command  # noqa: PLC0415 - help needs no statistics

    return compare_command(CompareOptions(**values))
