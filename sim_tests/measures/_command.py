"""The command ``awarenav compare``."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``compare`` to the commands."""
    compare = commands.add_parser(
        "compare",
        help="tables of policies, scenarios and awareness from runs that are done",
        description="Print what the episodes of one or more runs say: success, time lost, contacts "
        "and separation of every policy with confidence intervals, and every policy against the "
        "baseline on the same scenarios and seeds. A run may still be going on.",
        epilog="docs/metrics.md defines every figure. Exit status: 0 well, 2 bad input.",
    )
    compare.add_argument(
        "runs",
        nargs="+",
        type=Path,
        metavar="DIR|FILE",
        help="folders with an episodes.csv, or such files, also as .parquet",
    )
    compare.add_argument(
        "--baseline",
        default="blind",
        metavar="NAME",
        help="the policy that others are compared with (default: blind)",
    )
    compare.add_argument(
        "--level",
        type=float,
        default=0.95,
        metavar="X",
        help="confidence of the intervals, between 0 and 1 (default: 0.95)",
    )
    compare.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the bootstrap (default: 0)"
    )
    compare.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="also write the episodes of all runs into one table, .csv or .parquet",
    )
    compare.set_defaults(run=_compare)


def _compare(options: argparse.Namespace) -> int:
    from ._compare import compare_command  # noqa: PLC0415 - help needs no statistics

    return compare_command(options)
