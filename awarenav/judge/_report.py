"""The work of ``awarenav judge``, and its metrics as Markdown tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from tracking.config import complaints

from ..errors import AwarenavError, counted
from ..files import json_text, write_text
from ._intervals import Ends
from ._judge import JudgeConfig, judge_files
from ._requirements import interval_text, requirements, value_text

# Rows of the table by group: title, key, unit.
_GROUP_ROWS: Final = (
    ("people", "people", "n"),
    ("found", "recall", "%"),
    ("no gaze", "gaze_none", "%"),
    ("head median", "head_median_deg", "°"),
    ("head p90", "head_p90_deg", "°"),
    ("head > 90°", "head_over_90deg", "%"),
    ("gaze median", "gaze_median_deg", "°"),
    ("gaze p90", "gaze_p90_deg", "°"),
    ("position median", "position_median", "%"),
    ("position p90", "position_p90", "%"),
    ("range bias", "range_bias", "%"),
    ("no α", "awareness_none", "%"),
    ("α error", "awareness_mae", ""),
    ("falsely aware", "false_aware", "%"),
    ("aware recognised", "aware_recognised", "%"),
    ("α in 1σ", "awareness_within_1sigma", "%"),
    ("α in 1σ, all", "awareness_within_1sigma_all", "%"),
    ("position in 1σ", "position_within_1sigma", "%"),
    ("position NEES (3)", "position_nees", ""),
)


# Rows of the table of what the groups do not show: title, group, key, unit.
_OTHER_ROWS: Final = (
    (
        "reported where nobody is, or twice, per frame",
        "detection",
        "false_positives_per_frame",
        "",
    ),
    ("α mean absolute error, no α counted as 0", "overall", "awareness_mae_none_as_0", ""),
    (
        "α ≥ 0.5 where the truth is 0, hidden and small people too",
        "hidden_and_small_too",
        "false_aware",
        "%",
    ),
)


def judge_command(
    truth: Path,
    estimates: Path,
    *,
    out: Path | None,
    as_json: bool,
    common: bool,
    gate: bool,
    **settings: float,
) -> int:
    """Run the command; return the exit status.

    Args:
        truth: JSON Lines.
        estimates: JSON Lines.
        out: a file for the report (.md) or all metrics (.json).
        as_json: prints all metrics instead of the report.
        common: leaves out frames without an estimate.
        gate: makes a requirement that is not met the status 1.
        settings: of :class:`JudgeConfig`.

    Raises:
        AwarenavError: for files or options that cannot be used.
    """
    if out is not None and out.suffix not in (".json", ".md"):
        raise AwarenavError(f"--out must end in .json or .md, got {out}")
    try:
        config = JudgeConfig(**settings)
    except ValidationError as cause:
        raise AwarenavError(complaints(cause)) from cause
    metrics = judge_files(truth, estimates, config, common=common)
    report = markdown_report(metrics)
    print(json_text(metrics) if as_json else report, end="")
    if out is not None:
        write_text(out, report if out.suffix == ".md" else json_text(metrics))
    return 1 if gate and not all(each.met for each in requirements(metrics)) else 0


def markdown_report(metrics: dict[str, Any]) -> str:
    """Return the report as Markdown."""
    settings, frames, overall = metrics["settings"], metrics["frames"], metrics["overall"]
    height, hidden, outside = (
        settings[name] for name in ("min_height_px", "max_occlusion", "max_truncation")
    )
    ignored = metrics["hidden_and_small_too"]["people"] - overall["people"]
    lines = [
        f"{counted(frames['judged'], 'frame')}, {counted(overall['people'], 'person', 'people')} "
        f"to be found (at least {height:g} px tall, less than {hidden:.0%} hidden and less than "
        f"{outside:.0%} outside the picture); "
        f"{counted(ignored, 'other counts', 'others count')} neither way.",
    ]
    if frames["without_estimates"]:
        without = counted(frames["without_estimates"], "frame has", "frames have")
        lines.append(f"{without} no estimate, so nobody was found there.")
    if frames["unknown"]:
        unknown = counted(frames["unknown"], "estimated frame is", "estimated frames are")
        lines.append(f"{unknown} not in the truth and left out.")
    asked = requirements(metrics)
    rows = [
        (
            each.name,
            value_text(each.value, each.unit),
            "–" if each.value is None else interval_text(each.interval, each.unit),
            each.limits,
            "**no**" if each.verdict == "no" else each.verdict,
        )
        for each in asked
    ]
    lines += ["", *_table(("figure", "value", "95 % interval", "asked", "met"), rows)]
    if any(each.verdict == "too few to tell" for each in asked):
        lines += [
            "",
            "Too few to tell: the interval holds values that meet what is asked, and others.",
        ]
    beside = []
    for title, group, key, unit in _OTHER_ROWS:
        ends = metrics["intervals"][group].get(key)
        interval = "–" if ends is None else interval_text(ends, unit)
        beside.append((title, value_text(metrics[group][key], unit), interval))
    lines += ["", *_table(("beside that", "value", "95 % interval"), beside)]
    return "\n".join([*lines, "", *_group_table(metrics)]) + "\n"


def _group_table(metrics: dict[str, Any]) -> list[str]:
    """Return the table with a column for each group of people."""
    ends = metrics["intervals"]
    groups = [("all", metrics["overall"], ends["overall"])]
    for part, unit in (("by_facing", ""), ("by_range_m", " m")):
        groups += [(f"{name}{unit}", metrics[part][name], ends[part][name]) for name in ends[part]]
    groups = [each for each in groups if each[1]["people"]]

    def cell(values: dict[str, Any], intervals: dict[str, Ends], key: str, unit: str) -> str:
        text = value_text(values[key], unit)
        return f"{text} {interval_text(intervals[key], unit)}" if key in intervals else text

    rows = [
        (title, *(cell(values, intervals, key, unit) for _, values, intervals in groups))
        for title, key, unit in _GROUP_ROWS
        if any(values[key] is not None for _, values, _ in groups)
    ]
    return _table(("", *(name for name, _, _ in groups)), rows)


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a Markdown table whose columns are also aligned as plain text."""
    everything = [header, *rows]
    widths = [max(len(row[column]) for row in everything) for column in range(len(header))]
    widths = [max(width, 3) for width in widths]

    def line(cells: tuple[str, ...]) -> str:
        padded = (cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        return "| " + " | ".join(padded) + " |"

    return [line(header), line(tuple("-" * width for width in widths)), *map(line, rows)]
