"""The commands ``awarenav measures`` and ``awarenav export``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from awarenav.cli import FilePath, FolderPath, OneOf, argument, command, group, option, options

#: Names of the formats of exported episodes; those of ``_files.FORMATS``.
FORMAT_NAMES = ("socnav3", "navwareset")


@command(
    "measures",
    examples=[
        "awarenav measures crossings",
        "awarenav measures crossings --workers 2 --out social.csv",
        "awarenav measures track_scene1_col1.csv",
    ],
    exit_status={0: "Success.", 1: "An episode broke off with an error.", 2: "Bad input."},
    epilog="docs/social_measures.md defines every measure and names its source. The episodes of a "
    "run are run again, which takes as long as the run. Needs the extra 'bench'.",
)
@argument(
    "sources",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="DIR|FILE.csv...",
    help="Folders of runs, or tracks with the columns of NavWareSet.",
)
@options.workers()
@options.out_file(
    None, "Table with a row for each episode.", "FILE.csv", show_default="DIR/social.csv of one run"
)
@options.as_json("the means")
def measures(
    sources: tuple[Path, ...], workers: int | None, out: Path | None, as_json: bool
) -> int:
    """Measure episodes as other projects do: HuNavSim, SocNavGym, NavWareSet.

    Prints SPL, STL, distances, zones, accelerations, social work and more: the mean over the
    episodes of each policy.
    """
    from ._runs import measure_sources  # noqa: PLC0415 - help needs no runs

    return measure_sources(sources, workers=workers, out=out, as_json=as_json)


@group("export")
def export() -> None:
    """Write episodes in the formats of other projects."""


@command(
    "episode",
    short_help="Write one episode of a run.",
    examples=[
        "awarenav export episode run 12",
        "awarenav export episode run blind_corner:3:balanced --format navwareset",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="docs/social_measures.md describes the formats.",
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@argument(
    "episode",
    help="The number of the episode in episodes.csv, from 0; or SCENARIO:SEED:POLICY, followed by "
    ":PLANNER and :FAULT if the run has several.",
)
@option(
    "--format",
    type=OneOf(FORMAT_NAMES),
    default=None,
    show_default="that of --out, or socnav3",
    help="Format of the file.",
)
@options.out_file(None, "The file.", "FILE.json|csv", show_default="DIR/exports/episode_NUMBER")
def export_episode(**values: Any) -> int:
    """Run one episode of a run again and write the paths of robot and people.

    The formats are the JSON of SocNav3 and the CSV columns of NavWareSet.
    """
    from ._runs import export_episode as export_to_file  # noqa: PLC0415 - help needs no runs

    return export_to_file(**values)


export.add_command(export_episode)
