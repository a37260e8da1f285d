"""The command ``awarenav report``."""

from __future__ import annotations

from pathlib import Path

from awarenav.cli import FolderPath, argument, command, option, options


@command(
    "report",
    epilog="docs/bench.md explains the page. Exit status: 0 success; 2 bad input, nothing written. "
    "Stills need the simulator, everything else only the extra 'bench'.",
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@options.out_file(None, "The page (default: report.html in DIR).", metavar="FILE.html")
@option("--no-stills", is_flag=True, help="Make no pictures of the worst episodes (faster).")
def report(folder: Path, out: Path | None, *, no_stills: bool) -> int:
    """Write report.html from the episodes.csv, jobs.jsonl and run.json of a run.

    The page shows contacts, margins and the time that awareness saves, with confidence intervals;
    every scenario and episode; and stills of the worst ones. It needs no network and no other file.
    A run that is unfinished or has failed episodes makes a page that says so.
    """
    from ._write import write_report  # noqa: PLC0415 - help needs no statistics

    path = write_report(folder, stills=not no_stills, path=out, progress=True)
    print(f"Written: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")
    return 0
