"""The command ``awarenav report``."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``report`` to the commands."""
    report = commands.add_parser(
        "report",
        help="one HTML page that says what a run of crossings shows",
        description="Write report.html from the episodes.csv, jobs.jsonl and run.json of a run: "
        "what is safe and what awareness wins back, with confidence intervals, every scenario and "
        "episode, and stills of the worst ones. The page needs no network and no other file. A run "
        "that is not finished, or has failed episodes, makes a page that says so.",
        epilog="docs/bench.md explains the page. Exit status: 0 well, 2 bad input and nothing "
        "written. Stills need the simulator, all else only the extra 'bench'.",
    )
    report.add_argument("dir", type=Path, metavar="DIR", help="folder that `crossings --out` wrote")
    report.add_argument(
        "--out", type=Path, metavar="FILE.html", help="the page (default: report.html in DIR)"
    )
    report.add_argument(
        "--no-stills",
        action="store_true",
        help="do not run the worst episodes again for pictures of them (faster)",
    )
    report.set_defaults(run=_report)


def _report(options: argparse.Namespace) -> int:
    from ._write_report import write_report  # noqa: PLC0415 - help needs no statistics

    path = write_report(options.dir, stills=not options.no_stills, path=options.out, progress=True)
    print(f"Written: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")
    return 0
