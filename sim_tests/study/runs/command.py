"""The command ``awarenav replay``."""

from __future__ import annotations

from typing import Any

from awarenav.cli import FolderPath, argument, command, option


@command("replay", epilog="Exit status: 0 the same row; 1 another row; 2 bad input.")
@argument("folder", type=FolderPath(), metavar="DIR", help="Folder of the run.")
@argument(
    "episode",
    help="Its number, counted from 0 in the order of episodes.csv and jobs.jsonl; or "
    "SCENARIO:SEED:POLICY, followed by :PLANNER and :FAULT where that is not enough.",
)
@option(
    "--out", type=FolderPath(), metavar="DIR", help="Folder of the pictures (default: DIR/replays)."
)
@option("--no-video", is_flag=True, help="Draw the map only (faster).")
def replay(**values: Any) -> int:
    """Run one episode of a run again, film it and draw it from above.

    Says whether the episode gives the same row as before.
    """
    from ._replay import ReplayOptions, replay_command  # noqa: PLC0415 - help needs no simulator

    return replay_command(ReplayOptions(**values))
