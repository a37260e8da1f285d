"""Shared by all benchmarks: command line, baseline, exit status, and figures in pages."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from awarenav.baseline import MeasuredValue, read_baseline, worse_than, write_baseline
from awarenav.errors import AwarenavError

# A part of a page that is made from rows, between two comments.
_PART: Final = re.compile(r"(<!-- figures: (\w+) .*?-->\n\n).*?(\n\n<!-- end of figures -->)", re.S)


def with_figures(page: str, parts: Mapping[str, str]) -> str:
    """Return the text of a page with the parts, by name, between its comments."""
    return _PART.sub(lambda found: f"{found[1]}{parts[found[2]]}{found[3]}", page)


def count(text: str) -> int:
    """Return a whole number of at least 1, as the ``type`` of an argument."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number of at least 1, got {text!r}")
    return value


def make_parser(
    program: str, description: str, baseline: Path | None = None
) -> argparse.ArgumentParser:
    """Return a parser, with ``--baseline`` and ``--out`` for a benchmark that has a baseline.

    Args:
        program: module to run, such as ``"benchmarks.people"``.
        description: what the benchmark measures.
        baseline: the committed baseline, if any.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {program}", description=description)
    if baseline is None:
        return parser
    parser.add_argument(
        "--baseline",
        type=Path,
        default=baseline,
        metavar="FILE",
        help=f"figures to compare with, if it exists (default: {baseline.name} beside this file)",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the figures as a baseline")
    return parser


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Add ``--seed``, which :func:`parse` checks."""
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="default: 0")


def parse(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None
) -> tuple[argparse.Namespace, dict[str, MeasuredValue]]:
    """Parse a command line and read the baseline that it names; exits with 2 for bad input."""
    options = parser.parse_args(arguments)
    if options.out is not None and not options.out.absolute().parent.is_dir():
        parser.error(f"--out must be a file in a folder that exists, got {options.out}")
    if getattr(options, "seed", 0) < 0:
        parser.error(f"--seed must be 0 or more, got {options.seed}")
    try:
        baseline = read_baseline(options.baseline) if options.baseline.exists() else {}
    except AwarenavError as error:
        parser.error(str(error))
    return options, baseline


def bad_input(parser: argparse.ArgumentParser, error: Exception) -> int:
    """Print an error and return the exit status of bad input."""
    print(f"{parser.prog}: {error}", file=sys.stderr)
    return 2


def finish(
    metrics: Sequence[MeasuredValue],
    missed: Sequence[str],
    baseline: dict[str, MeasuredValue],
    out: Path | None,
) -> int:
    """Print missed goals and worse figures, write the figures, and return the exit status.

    Args:
        metrics: the measured figures.
        missed: one line for each goal that was missed.
        baseline: figures to compare with; empty for no comparison.
        out: file for the figures; None writes none.
    """
    lines = [*worse_than(baseline, metrics), *missed]
    for line in lines:
        print(f"NOT AS WANTED  {line}")
    if out is not None:
        write_baseline(out, metrics)
    return 1 if lines else 0
