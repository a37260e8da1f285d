"""The command line that all benchmarks share: baseline, output file, and the verdict."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from awarenav.baseline import Metric, read_baseline, worse_than, write_baseline
from awarenav.errors import AwarenavError


def count(text: str) -> int:
    """Return a whole number of at least 1, as the ``type`` of an argument."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 1, got {text!r}")
    return value


def make_parser(program: str, description: str, baseline: Path) -> argparse.ArgumentParser:
    """Return a parser with ``--baseline`` and ``--out``.

    Args:
        program: module that is run, as ``"benchmarks.adapter"``.
        description: what is measured.
        baseline: the committed baseline.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {program}", description=description)
    parser.add_argument(
        "--baseline",
        type=Path,
        default=baseline,
        metavar="FILE",
        help=f"figures to compare with, if it exists (default: {baseline.name} beside this file)",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the figures as a baseline")
    return parser


def parse(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None
) -> tuple[argparse.Namespace, dict[str, Metric]]:
    """Parse a command line and read the baseline that it names; exits with 2 for bad input."""
    options = parser.parse_args(arguments)
    if options.out is not None and not options.out.absolute().parent.is_dir():
        parser.error(f"--out must be a file in a folder that exists, got {options.out}")
    try:
        baseline = read_baseline(options.baseline) if options.baseline.exists() else {}
    except AwarenavError as error:
        parser.error(str(error))
    return options, baseline


def finish(
    metrics: Sequence[Metric],
    missed: Sequence[str],
    baseline: dict[str, Metric],
    out: Path | None,
) -> int:
    """Print what is not as wanted, write the figures if asked, and return the exit status.

    Args:
        metrics: measured.
        missed: goals that were missed, a line each.
        baseline: to compare with; empty compares nothing.
        out: file for the figures.
    """
    lines = [*worse_than(baseline, metrics), *missed]
    for line in lines:
        print(f"NOT AS WANTED  {line}")
    if out is not None:
        write_baseline(out, metrics)
    return 1 if lines else 0
