"""The command ``awarenav tracks``."""

from __future__ import annotations

from typing import Any

from ..cli import POSITIVE, FilePath, argument, command, option, options


@command(
    "tracks",
    epilog="Exit status: 0 success; 2 bad input, nothing written; 130 interrupted. The plot needs "
    "matplotlib.",
)
@argument("file", type=FilePath(), metavar="FILE.jsonl", help="Estimates, or rendered truth.")
@options.out_file(
    "tracks.png", "The plot; an existing file is replaced.", metavar="FILE.png|svg|pdf|none"
)
@options.as_json()
@option(
    "--csv", type=FilePath(), metavar="FILE", help="Also write every track at every frame as CSV."
)
@option(
    "--truth",
    type=FilePath(),
    metavar="TRUTH.jsonl",
    help="Also draw the true paths and the true awareness, matched by stamp.",
)
@option("--config", type=FilePath(), metavar="FILE", help="Settings of the tracker (YAML).")
@option(
    "--ids",
    is_flag=True,
    excludes="--config",
    help="Do not track: show the tracks (`awarenav estimate --tracks`) or ids in the file.",
)
@option(
    "--camera",
    type=FilePath(),
    metavar="FILE",
    help="ROS camera_info YAML of the field of view (default: camera.yaml beside FILE, if any).",
)
@option(
    "--most",
    type=POSITIVE,
    default=20,
    metavar="N",
    help="Tracks with a colour and a panel of their own, the most often seen; others are grey.",
)
def tracks(**values: Any) -> int:
    """Track the people in FILE; print a line for each track, and plot paths and awareness.

    FILE is JSON Lines as `awarenav estimate` or `awarenav render` writes them. Frames are processed
    in the order of the file, as on a robot.
    """
    from ._run import TracksOptions, tracks_command  # noqa: PLC0415 - help needs no tracker

    return tracks_command(TracksOptions(**values))
