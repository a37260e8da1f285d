"""The work of ``awarenav judge``: what is asked of the metrics, and both as tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from ..cli import table_text
from ..errors import counted
from ..files import check_output, json_text, write_text
from ..intervals import UNBOUNDED, Ends
from ._judge import judge_files

Verdict = Literal["yes", "no", "too few to tell"]
# Makes lines of a header and rows.
_Layout = Callable[[tuple[str, ...], Sequence[tuple[str, ...]]], list[str]]

# The project's requirements for its own networks on rendered people: title, group of metrics, key,
# smallest and largest value that is asked, and unit. {gaze} is the head, or the gaze where the
# truth knows no head. A normal error is within one standard deviation with probability 0.68.
_ASKED: Final = (
    ("detection AP50", "detection", "ap50", 0.97, math.inf, ""),
    ("{gaze} direction error, median", "overall", "{gaze}_median_deg", -math.inf, 5.0, "°"),
    ("{gaze} direction error, 90th percentile", "overall", "{gaze}_p90_deg", -math.inf, 15.0, "°"),
    ("position error / range, median", "overall", "position_median", -math.inf, 0.04, "%"),
    ("α mean absolute error", "overall", "awareness_mae", -math.inf, 0.08, ""),
    ("α ≥ 0.5 where the truth is 0", "overall", "false_aware", -math.inf, 0.005, "%"),
    (
        "error of α within 1σ (truth or estimate in (0, 1))",
        "overall",
        "awareness_within_1sigma",
        0.68 - 0.08,
        0.68 + 0.08,
        "%",
    ),
)
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
    truth: Path, estimates: Path, *, out: Path | None, as_json: bool, common: bool, gate: bool
) -> int:
    """Run the command; return the exit status.

    Args:
        truth: JSON Lines.
        estimates: JSON Lines.
        out: a file for the report (.md) or all metrics (.json).
        as_json: prints all metrics instead of the report.
        common: leaves out frames without an estimate.
        gate: makes a requirement that is not met the status 1.

    Raises:
        AwarenavError: for files or options that cannot be used.
    """
    if out is not None:
        check_output(out, (".json", ".md"), (truth, estimates))
    metrics = judge_files(truth, estimates, common=common)
    print(json_text(metrics) if as_json else report_text(metrics, _terminal_table), end="")
    if out is not None:
        markdown = out.suffix.lower() == ".md"
        write_text(out, report_text(metrics, _table) if markdown else json_text(metrics))
    return 1 if gate and not all(each.met for each in requirements(metrics)) else 0


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement for a metric.

    Attributes:
        name: title of the metric.
        value: the metric; None if nobody contributed to it.
        low: smallest value that is asked.
        high: largest value that is asked.
        unit: "%", "°" or empty.
        interval: the 95 % interval of the metric.
    """

    name: str
    value: float | None
    low: float
    high: float
    unit: str
    interval: Ends = UNBOUNDED

    @property
    def met(self) -> bool:
        """True if the metric itself lies between its limits, whatever its interval."""
        return self.value is not None and self.low <= self.value <= self.high

    @property
    def verdict(self) -> Verdict:
        """``"yes"`` or ``"no"`` if the whole interval meets or misses what is asked."""
        low, high = self.interval
        if self.value is None:
            return "too few to tell"
        if self.low <= low and high <= self.high:
            return "yes"
        return "no" if high < self.low or self.high < low else "too few to tell"

    @property
    def limits(self) -> str:
        """The limits as text."""
        low, high = (value_text(limit, self.unit) for limit in (self.low, self.high))
        if self.low == -math.inf:
            return f"≤ {high}"
        return f"≥ {low}" if self.high == math.inf else f"{low} to {high}"


def requirements(metrics: dict[str, Any]) -> list[Requirement]:
    """Return the project's requirements with the metrics; ``--gate`` checks them."""
    gaze = "head" if metrics["overall"]["head_count"] else "gaze"
    asked = []
    for title, group, name, low, high, unit in _ASKED:
        key = name.format(gaze=gaze)
        ends = metrics["intervals"][group].get(key, UNBOUNDED)
        asked.append(
            Requirement(title.format(gaze=gaze), metrics[group][key], low, high, unit, ends)
        )
    return asked


def value_text(value: float | None, unit: str) -> str:
    """Return a metric as text; the unit is "%", "°", "n" (a count) or empty."""
    if value is None:
        return "–"
    if unit == "%":
        return (
            f"{100.0 * value:.1f} %"
            if abs(value) >= 0.1 or value == 0
            else f"{100.0 * value:.2f} %"
        )
    if unit == "°":
        return f"{value:.1f}°"
    return f"{value:.0f}" if unit == "n" else f"{value:.3f}"


def interval_text(ends: Ends, unit: str) -> str:
    """Return an interval as text, ``[3.1, 5.0]``; a question mark stands for an infinite end."""
    low, high = (
        "?" if math.isinf(end) else value_text(end, unit).removesuffix(unit).rstrip()
        for end in ends
    )
    return f"[{low}, {high}]"


def report_text(metrics: dict[str, Any], table: _Layout) -> str:
    """Return the report, with tables in Markdown or for the terminal."""
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
    lines += ["", *table(("figure", "value", "95 % interval", "asked", "met"), rows)]
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
    lines += ["", *table(("beside that", "value", "95 % interval"), beside)]
    return "\n".join([*lines, "", *_group_table(metrics, table)]) + "\n"


def _group_table(metrics: dict[str, Any], table: _Layout) -> list[str]:
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
    return table(("", *(name for name, _, _ in groups)), rows)


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a Markdown table whose columns are also aligned as plain text."""
    everything = [header, *rows]
    widths = [max(len(row[column]) for row in everything) for column in range(len(header))]
    widths = [max(width, 3) for width in widths]

    def line(cells: tuple[str, ...]) -> str:
        padded = (cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        return "| " + " | ".join(padded) + " |"

    return [line(header), line(tuple("-" * width for width in widths)), *map(line, rows)]


def _terminal_table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a table that fits the terminal."""
    plain = [tuple(cell.replace("**", "") for cell in row) for row in rows]
    return [table_text(header, plain)]
