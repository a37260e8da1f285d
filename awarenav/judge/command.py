"""The command ``awarenav judge``."""

from __future__ import annotations

from typing import Any

from ..cli import FilePath, argument, command, option, options


@command(
    "judge", epilog="Exit status: 0 success; 1 with --gate, a requirement missed; 2 bad input."
)
@argument("truth", type=FilePath(), metavar="TRUTH.jsonl", help="The truth, a line for each frame.")
@argument("estimates", type=FilePath(), metavar="ESTIMATES.jsonl", help="Estimates of its frames.")
@options.out_file(None, "Also write the table (.md) or every figure (.json).", "FILE.md|json")
@options.as_json("every figure")
@option(
    "--min-height-px",
    type=float,
    default=40.0,
    metavar="PX",
    help="People less tall in the image need not be found.",
)
@option(
    "--max-occlusion",
    type=float,
    default=0.5,
    metavar="SHARE",
    help="People hidden to this share or more need not be found.",
)
@option(
    "--max-truncation",
    type=float,
    default=0.5,
    metavar="SHARE",
    help="People outside the image to this share or more need not be found.",
)
@option(
    "--common",
    is_flag=True,
    help="Leave out frames without an estimate. Otherwise nobody was found in them.",
)
@option(
    "--gate",
    is_flag=True,
    help="Exit with 1 when a figure misses what the project requires of its own networks.",
)
def judge(**values: Any) -> int:
    """Compare ESTIMATES with TRUTH, both as `awarenav render` and `awarenav estimate` write them.

    Prints a Markdown table: detection (COCO's average precision at IoU 0.5, 101 recalls), gaze,
    position, awareness, and whether the stated uncertainties hold; by facing and by range.
    """
    from ._run import JudgeOptions, judge_command  # noqa: PLC0415 - help needs no arrays

    return judge_command(JudgeOptions(**values))
