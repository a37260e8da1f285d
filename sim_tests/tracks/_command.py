"""The command ``awarenav tracks``."""

from __future__ import annotations

import argparse
from pathlib import Path

from .._arguments import count

_MOST = 20


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add ``tracks`` to the commands."""
    tracks = commands.add_parser(
        "tracks",
        help="who was followed through an estimates file: paths, awareness over time",
        description="Run the tracker over the frames of a JSON Lines file that `awarenav estimate` "
        "or `awarenav render` wrote, print a line a track, and draw the paths from above and each "
        "track's awareness over time. Frames are taken in the order of the file, as a robot would.",
        epilog="Exit status: 0 well, 2 bad input and nothing written, 130 interrupted. Needs "
        "matplotlib for the plot, and no simulator.",
    )
    tracks.add_argument("file", type=Path, metavar="FILE.jsonl")
    tracks.add_argument(
        "--out",
        default="tracks.png",
        metavar="FILE.png|svg|pdf|none",
        help="the plot; a file that is there is replaced (default: tracks.png)",
    )
    tracks.add_argument(
        "--csv", type=Path, metavar="FILE", help="write every track at every frame as a table too"
    )
    tracks.add_argument(
        "--truth",
        type=Path,
        metavar="TRUTH.jsonl",
        help="draw where people truly were and how aware they truly were, matched by stamp",
    )
    who = tracks.add_mutually_exclusive_group()
    who.add_argument("--config", type=Path, metavar="FILE", help="tracker settings (YAML)")
    who.add_argument(
        "--ids",
        action="store_true",
        help="do not track: show the tracks (`estimate --tracks`) or ids that the file has",
    )
    tracks.add_argument(
        "--camera",
        type=Path,
        metavar="FILE",
        help="ROS camera_info YAML of the field of view (default: camera.yaml beside FILE, else "
        "none is known)",
    )
    tracks.add_argument(
        "--most",
        type=count,
        default=_MOST,
        metavar="N",
        help="tracks with a colour and a panel, those seen most often first; the others are drawn "
        f"grey (default: {_MOST})",
    )
    tracks.set_defaults(run=_tracks)


def _tracks(options: argparse.Namespace) -> int:
    from ._tracks_command import tracks_command  # noqa: PLC0415 - help needs no tracker

    return tracks_command(options)
