"""The command ``awarenav judge``."""

from __future__ import annotations

from typing import Any

from ..cli import FilePath, argument, command, option, options


@command(
    "judge",
    examples=["awarenav judge render/truth.jsonl estimates.jsonl --out report.md"],
    exit_status={
        0: "Success.",
        1: "With --gate: a figure fails its requirement.",
        2: "Bad input.",
    },
)
@argument("truth", type=FilePath(), metavar="TRUTH.jsonl", help="The truth: one line per frame.")
@argument("estimates", type=FilePath(), metavar="ESTIMATES.jsonl", help="Estimates of its frames.")
@options.out_file(None, "Also write the report (.md) or all metrics (.json).", "FILE.md|json")
@options.as_json("all metrics")
@option(
    "--common",
    is_flag=True,
    help="Ignore frames without an estimate; by default, everybody in them counts as missed.",
)
@option(
    "--gate",
    is_flag=True,
    help="Exit with status 1 unless the figures themselves, whatever their intervals, meet the "
    "project's requirements for its own networks.",
)
def judge(**values: Any) -> int:
    """Compare ESTIMATES with TRUTH, as `awarenav estimate` and `awarenav render` write them.

    Prints Markdown tables: detection (COCO's average precision at IoU 0.5), gaze, position and
    awareness, and whether the stated uncertainties hold; for everybody, by facing and by range.
    Every figure has its 95 % interval. A requirement is met (yes), not met (no), or there are too
    few people to tell: the interval contains the bound.
    """
    from ._report import judge_command  # noqa: PLC0415 - help needs no arrays

    return judge_command(**values)
