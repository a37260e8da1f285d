"""The command ``awarenav replay``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import FolderPath, argument, command, option, options


@command(
    "replay",
    examples=[
        "awarenav replay run 12",
        "awarenav replay run blind_corner:3:balanced --no-video",
        "awarenav replay run 12 --view",
        "awarenav replay run all --view",
    ],
    exit_status={
        0: "The episode gives the same row as before.",
        1: "The episode gives another row.",
        2: "Bad input.",
    },
)
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of `awarenav crossings --out`.")
@argument(
    "episode",
    help="The number of the episode in episodes.csv, from 0; or SCENARIO:SEED:POLICY, followed by "
    ":PLANNER and :FAULT if the run has several; or 'all'.",
)
@options.out_folder(
    None, "Folder of the video and the map, or of the page.", show_default="DIR/replays"
)
@option("--no-video", is_flag=True, help="Draw only the map (faster).")
@option(
    "--view",
    is_flag=True,
    excludes="--no-video",
    help="Write a page for the browser instead of video and map, and open it if there is a "
    "display. The report links to it.",
)
def replay(**values: Any) -> int:
    """Run one episode of a run again, film it and draw it from above, or write its page.

    Prints whether the episode gives the same row as before.
    """
    from ._replay import ReplayOptions, replay_command  # noqa: PLC0415 - help needs no simulator

    return replay_command(ReplayOptions(**values))
