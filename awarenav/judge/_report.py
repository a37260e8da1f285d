"""The metrics of ``awarenav judge`` as Markdown tables, and the requirements for them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from ._judge import JudgeLimits

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


@dataclass(frozen=True, slots=True)
class Requirement:
    """A requirement for a metric; a metric to which nobody contributed does not meet it."""

    name: str
    value: float | None
    low: float
    high: float
    unit: str

    @property
    def met(self) -> bool:
        """True if the metric lies between its limits."""
        return self.value is not None and self.low <= self.value <= self.high

    @property
    def limits(self) -> str:
        """The limits as text."""
        low, high = (_value_text(limit, self.unit) for limit in (self.low, self.high))
        if self.low == -math.inf:
            return f"≤ {high}"
        return f"≥ {low}" if self.high == math.inf else f"{low} to {high}"


def requirements(metrics: dict[str, Any], limits: JudgeLimits | None = None) -> list[Requirement]:
    """Return the project's requirements with the metrics.

    The gaze is the direction of the head if the truth has both head and eyes.
    """
    limits = JudgeLimits() if limits is None else limits
    overall = metrics["overall"]
    gaze = "head" if overall["head_count"] else "gaze"
    middle, margin = limits.within_1sigma, limits.within_1sigma_tolerance
    return [
        Requirement("detection AP50", metrics["detection"]["ap50"], limits.min_ap50, math.inf, ""),
        Requirement(
            f"{gaze} direction error, median",
            overall[f"{gaze}_median_deg"],
            -math.inf,
            limits.max_gaze_median_deg,
            "°",
        ),
        Requirement(
            f"{gaze} direction error, 90th percentile",
            overall[f"{gaze}_p90_deg"],
            -math.inf,
            limits.max_gaze_p90_deg,
            "°",
        ),
        Requirement(
            "position error / range, median",
            overall["position_median"],
            -math.inf,
            limits.max_position_median,
            "%",
        ),
        Requirement(
            "α mean absolute error",
            overall["awareness_mae"],
            -math.inf,
            limits.max_awareness_mae,
            "",
        ),
        Requirement(
            "α ≥ 0.5 where the truth is 0",
            overall["false_aware"],
            -math.inf,
            limits.max_false_aware,
            "%",
        ),
        Requirement(
            "error of α within 1σ (truth or estimate in (0, 1))",
            overall["awareness_within_1sigma"],
            middle - margin,
            middle + margin,
            "%",
        ),
    ]


def markdown_report(metrics: dict[str, Any], limits: JudgeLimits | None = None) -> str:
    """Return the report as Markdown."""
    settings, frames, overall = metrics["settings"], metrics["frames"], metrics["overall"]
    detection, others = metrics["detection"], metrics["hidden_and_small_too"]
    lines = [
        f"{frames['judged']} frames, {overall['people']} people to be found (at least "
        f"{settings['min_height_px']:g} px tall, less than {settings['max_occlusion']:.0%} hidden "
        f"and less than {settings['max_truncation']:.0%} outside the picture); "
        f"{others['people'] - overall['people']} others count neither way.",
    ]
    if frames["without_estimates"]:
        lines.append(
            f"{frames['without_estimates']} frames have no estimate: nobody was found in them."
        )
    if frames["unknown"]:
        lines.append(f"{frames['unknown']} estimated frames are not in the truth and left out.")
    lines += ["", *_table(("figure", "value", "asked", ""), _requirement_rows(metrics, limits))]
    rows = [
        (
            "found",
            f"{overall['found']} of {overall['people']} ({_value_text(overall['recall'], '%')})",
        ),
        (
            "people reported where nobody is, or twice",
            f"{detection['false_positives']} "
            f"({_value_text(detection['false_positives_per_frame'], '')} per frame)",
        ),
        ("found people without a gaze", _value_text(overall["gaze_none"], "%")),
        ("found people without an α", _value_text(overall["awareness_none"], "%")),
        (
            "α mean absolute error, no α counted as 0",
            _value_text(overall["awareness_mae_none_as_0"], ""),
        ),
        (
            "α ≥ 0.5 where the truth is 0",
            f"{overall['false_aware_count']} of {overall['unaware_judged']} estimates "
            f"({overall['unaware_people']} such people)",
        ),
        (
            "the same, hidden and small people too",
            f"{others['false_aware_count']} of {others['unaware_judged']} "
            f"({_value_text(others['false_aware'], '%')})",
        ),
        (
            "people with true α ≥ 0.5 recognised",
            f"{_value_text(overall['aware_recognised'], '%')} of {overall['aware_people']}",
        ),
    ]
    lines += ["", *_table(("beside that", ""), rows), "", *_group_table(metrics)]
    return "\n".join(lines) + "\n"


def _requirement_rows(metrics: dict[str, Any], limits: JudgeLimits | None) -> list[tuple[str, ...]]:
    return [
        (
            each.name,
            _value_text(each.value, each.unit),
            each.limits,
            "yes" if each.met else "**no**",
        )
        for each in requirements(metrics, limits)
    ]


def _group_table(metrics: dict[str, Any]) -> list[str]:
    """Return the table with a column for each group of people."""
    groups = [("all", metrics["overall"]), *metrics["by_facing"].items()]
    groups += [(f"{name} m", group) for name, group in metrics["by_range_m"].items()]
    groups = [(name, group) for name, group in groups if group["people"]]
    rows = [
        (title, *(_value_text(group[key], unit) for _, group in groups))
        for title, key, unit in _GROUP_ROWS
        if any(group[key] is not None for _, group in groups)
    ]
    return _table(("", *(name for name, _ in groups)), rows)


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a Markdown table whose columns are also aligned as plain text."""
    everything = [header, *rows]
    widths = [max(len(row[column]) for row in everything) for column in range(len(header))]
    widths = [max(width, 3) for width in widths]

    def line(cells: tuple[str, ...]) -> str:
        padded = (cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        return "| " + " | ".join(padded) + " |"

    return [line(header), line(tuple("-" * width for width in widths)), *map(line, rows)]


def _value_text(value: float | None, unit: str) -> str:
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
