"""The command ``awarenav report``."""

from __future__ import annotations

from pathlib import Path

from awarenav.cli import FolderPath, argument, command, option, options


@command(
    "report",
    examples=["awarenav report crossings"],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="docs/bench.md explains the page. Needs the extra 'bench'; the images of the worst "
    "episodes also need the extra 'sim'.",
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@options.out_file(None, "The page.", "FILE.html", show_default="DIR/report.html")
@option("--no-stills", is_flag=True, help="Make no images of the worst episodes (faster).")
def report(folder: Path, out: Path | None, *, no_stills: bool) -> int:
    """Write report.html from the episodes.csv, jobs.jsonl and run.json of a run.

    The page shows contacts, margins and the time that awareness saves, with confidence intervals;
    every scenario and episode; and images of the worst episodes. It is one file that needs no
    network. The page of an unfinished run, or of one with failed episodes, says so.
    """
    from ._write import write_report  # noqa: PLC0415 - help needs no statistics

    path = write_report(folder, stills=not no_stills, path=out, progress=True)
    print(f"Written: {path} ({path.stat().st_size / 1e6:.1f} MB); open it in a browser")
    return 0
