"""The command ``awarenav tracks``."""

from __future__ import annotations

from typing import Any

from ..cli import POSITIVE, Command, FilePath, Number, argument, command, option, options


@command(
    "tracks",
    examples=[
        "awarenav tracks estimates.jsonl --out tracks.png --csv tracks.csv",
        "awarenav tracks estimates.jsonl --truth render/truth.jsonl",
        "awarenav tracks people.csv --smooth",
    ],
    exit_status={
        0: "Success.",
        2: "Bad input; nothing was written.",
        130: "Interrupted.",
    },
)
@argument(
    "file",
    type=FilePath(),
    metavar="FILE.jsonl|FILE.csv|FILE.tsv",
    help="Estimates, rendered truth, or positions as CSV: t_s, id, x_m, y_m, and std_m if known.",
)
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
    "--smooth",
    is_flag=True,
    excludes="--ids",
    help="Also draw each path smoothed with later data, as a reference.",
)
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

    Reads JSON Lines as `awarenav estimate` and `awarenav render` write them, or positions as CSV.
    Frames are processed in the order of the file, as on a robot.
    """
    from ._run import tracks_command  # noqa: PLC0415 - help needs no tracker

    return tracks_command(**values)


@command(
    "calibrate",
    short_help="Fit the uncertainty of predicted people to your own recordings.",
    examples=[
        "awarenav tracks calibrate estimates.jsonl",
        "awarenav tracks calibrate monday.csv tuesday.csv --longest 1.5 --out site.yaml",
    ],
    exit_status={0: "Success.", 2: "Bad input; nothing was written."},
)
@argument(
    "files",
    nargs=-1,
    required=True,
    type=FilePath(),
    metavar="FILE...",
    help="Recordings, as `awarenav tracks` reads them.",
)
@options.out_file("prediction.yaml", "The model; replaces the file.", "FILE.yaml")
@options.as_json()
@option("--config", type=FilePath(), metavar="FILE", help="Settings of the tracker (YAML).")
@option(
    "--longest",
    type=Number(0.2, 10.0),
    default=2.0,
    metavar="S",
    help="Longest horizon of the prediction.",
)
def calibrate(**values: Any) -> int:
    """Track the people in FILE, and set how uncertain their predicted positions are.

    Each horizon gets a factor with which the region of two standard deviations contains 86.5 % of
    the people. To check it, each half of them is judged by the factors of the other half. The
    smoothed tracks count as the truth. Read the file with `PredictionModel.from_yaml`.
    """
    from ._calibrate import calibrate_command  # noqa: PLC0415

    return calibrate_command(**values)


assert isinstance(tracks, Command)
tracks.add_part(calibrate)
