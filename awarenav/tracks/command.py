"""The command ``awarenav tracks``."""

from __future__ import annotations

from typing import Any

from ..cli import POSITIVE, FilePath, argument, command, option, options


@command(
    "tracks",
    examples=[
        "awarenav tracks estimates.jsonl --out tracks.png --csv tracks.csv",
        "awarenav tracks estimates.jsonl --truth render/truth.jsonl",
    ],
    exit_status={
        0: "Success.",
        2: "Bad input; nothing was written.",
        130: "Interrupted.",
    },
)
@argument("file", type=FilePath(), metavar="FILE.jsonl", help="Estimates, or rendered truth.")
@options.plot_file("tracks.png", "The plot; replaces the file.")
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
    help="Do not track: show the tracks of `awarenav estimate --tracks`, or the ids, in the file.",
)
@option(
    "--camera",
    type=FilePath(),
    show_default="camera.yaml beside FILE.jsonl, if any",
    metavar="FILE",
    help="Camera whose field of view the tracker uses (ROS camera_info YAML).",
)
@option(
    "--most",
    type=POSITIVE,
    default=20,
    metavar="N",
    help="Give the N tracks that are seen most often a colour and a panel; draw the others grey.",
)
def tracks(**values: Any) -> int:
    """Track the people in FILE.jsonl; print one line per track, and plot paths and awareness.

    Reads JSON Lines as `awarenav estimate` and `awarenav render` write them. Frames are processed
    in the order of the file, as on a robot.
    """
    from ._run import TracksOptions, tracks_command  # noqa: PLC0415 - help needs no tracker

    return tracks_command(TracksOptions(**values))
