"""The commands ``awarenav measures`` and ``awarenav export``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from awarenav.cli import FilePath, FolderPath, OneOf, argument, command, group, option, options

#: Names of the formats of exported episodes; those of :data:`sim_tests.study.social.FORMATS`.
FORMAT_NAMES = ("socnav3", "navwareset", "mcap")


@command(
    "measures",
    examples=[
        "awarenav measures crossings",
        "awarenav measures crossings --workers 2 --out social.csv",
        "awarenav measures track_scene1_col1.csv trajectory.json",
    ],
    exit_status={0: "Success.", 1: "An episode broke off with an error.", 2: "Bad input."},
    epilog="docs/social_measures.md defines every measure and names its source. The episodes of a "
    "run are run again, which takes as long as the run.",
)
@argument(
    "sources",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="DIR|FILE...",
    help="Folders of runs, or episodes as SocNav3 .json, NavWareSet .csv or .mcap.",
)
@options.workers()
@options.out_file(
    None, "Table with a row for each episode.", "FILE.csv", show_default="DIR/social.csv of one run"
)
@options.as_json("the means")
def measures(**values: Any) -> int:
    """Measure episodes as other projects do: HuNavSim, SocNavGym, NavWareSet.

    Prints SPL, STL, distances, zones, accelerations, social work and more: the mean over the
    episodes of each policy.
    """
    from ._commands import MeasuresOptions, measures_command  # noqa: PLC0415 - help needs no runs

    return measures_command(MeasuresOptions(**values))


@group("export")
def export() -> None:
    """Write episodes in the formats of other projects, and check such files."""


@command(
    "episode",
    short_help="Write one episode of a run.",
    examples=[
        "awarenav export episode run 12",
        "awarenav export episode run blind_corner:3:balanced --format navwareset",
        "awarenav export episode run 12 --out encounter.mcap",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
    epilog="docs/social_measures.md describes the formats. MCAP needs the extra 'ros2'.",
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
@options.out_file(
    None, "The file.", "FILE.json|csv|mcap", show_default="DIR/exports/episode_NUMBER"
)
def export_episode(**values: Any) -> int:
    """Run one episode of a run again and write the paths of robot and people.

    The formats are the JSON of SocNav3, the CSV columns of NavWareSet, and MCAP with JSON messages
    for Foxglove.
    """
    from ._commands import ExportOptions, export_command  # noqa: PLC0415 - help needs no runs

    return export_command(ExportOptions(**values))


@command(
    "check",
    short_help="Check files of episodes.",
    examples=["awarenav export check episode_00012.json", "awarenav export check tracks.csv"],
    exit_status={0: "All files are correct.", 1: "A file is not.", 2: "Bad input."},
)
@argument(
    "files",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="FILE...",
    help="SocNav3 .json, NavWareSet .csv or .mcap.",
)
def export_check(files: tuple[Path, ...]) -> int:
    """Check that files follow the layout of their format, and say which field does not."""
    from ._commands import check_command  # noqa: PLC0415 - help needs no formats

    return check_command(files)


for _command in (export_episode, export_check):
    export.add_command(_command)
