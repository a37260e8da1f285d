"""The metrics of ``awarenav judge`` as Markdown tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from ..errors import counted
from ._intervals import Ends
from ._judge import JudgeLimits
from ._requirements import Requirement, interval_text, requirements, value_text

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


def markdown_report(metrics: dict[str, Any], limits: JudgeLimits | None = None) -> str:
    """Return the report as Markdown."""
    settings, frames, overall = metrics["settings"], metrics["frames"], metrics["overall"]
    detection, others = metrics["detection"], metrics["hidden_and_small_too"]
    height, hidden, outside = (
        settings[name] for name in ("min_height_px", "max_occlusion", "max_truncation")
    )
    ignored = others["people"] - overall["people"]
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
    asked = requirements(metrics, limits)
    lines += ["", *_table(("figure", "value", "95 % interval", "asked", "met"), _rows(asked))]
    if any(each.verdict == "too few to tell" for each in asked):
        lines += [
            "",
            "Too few to tell: the interval holds values that meet what is asked, and others.",
        ]
    rows = [
        (
            "found",
            f"{overall['found']} of {overall['people']} ({value_text(overall['recall'], '%')})",
            _interval(metrics, "overall", "recall", "%"),
        ),
        (
            "people reported where nobody is, or twice",
            f"{detection['false_positives']} "
            f"({value_text(detection['false_positives_per_frame'], '')} per frame)",
            _interval(metrics, "detection", "false_positives_per_frame", ""),
        ),
        (
            "found people without a gaze",
            value_text(overall["gaze_none"], "%"),
            _interval(metrics, "overall", "gaze_none", "%"),
        ),
        (
            "found people without an α",
            value_text(overall["awareness_none"], "%"),
            _interval(metrics, "overall", "awareness_none", "%"),
        ),
        (
            "α mean absolute error, no α counted as 0",
            value_text(overall["awareness_mae_none_as_0"], ""),
            _interval(metrics, "overall", "awareness_mae_none_as_0", ""),
        ),
        (
            "α ≥ 0.5 where the truth is 0",
            f"{overall['false_aware_count']} of "
            f"{counted(overall['unaware_judged'], 'estimate')} "
            f"({counted(overall['unaware_people'], 'such person', 'such people')})",
            _interval(metrics, "overall", "false_aware", "%"),
        ),
        (
            "the same, hidden and small people too",
            f"{others['false_aware_count']} of {others['unaware_judged']} "
            f"({value_text(others['false_aware'], '%')})",
            _interval(metrics, "hidden_and_small_too", "false_aware", "%"),
        ),
        (
            "people with true α ≥ 0.5 recognised",
            f"{value_text(overall['aware_recognised'], '%')} of {overall['aware_people']}",
            _interval(metrics, "overall", "aware_recognised", "%"),
        ),
    ]
    lines += ["", *_table(("beside that", "", "95 % interval"), rows), "", *_group_table(metrics)]
    return "\n".join(lines) + "\n"


def _rows(asked: Sequence[Requirement]) -> list[tuple[str, ...]]:
    """Return a row for each requirement."""
    return [
        (
            each.name,
            value_text(each.value, each.unit),
            "–" if each.value is None else interval_text(each.interval, each.unit),
            each.limits,
            "**no**" if each.verdict == "no" else each.verdict,
        )
        for each in asked
    ]


def _interval(metrics: dict[str, Any], group: str, key: str, unit: str) -> str:
    ends = metrics["intervals"][group].get(key)
    return "–" if ends is None else interval_text(ends, unit)


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
