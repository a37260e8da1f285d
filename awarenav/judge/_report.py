"""The figures of ``awarenav judge`` as a Markdown table, and what is asked of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from ._judge import JudgeLimits


@dataclass(frozen=True, slots=True)
class Requirement:
    """One line of what is asked; a figure that nobody contributed to does not meet it."""

    name: str
    value: float | None
    low: float
    high: float
    unit: str

    @property
    def met(self) -> bool:
        """Whether the figure lies between its limits."""
        return self.value is not None and self.low <= self.value <= self.high

    @property
    def asked(self) -> str:
        """The limits as text."""
        low, high = (_number(limit, self.unit) for limit in (self.low, self.high))
        if self.low == _LOWEST:
            return f"≤ {high}"
        return f"≥ {low}" if self.high == _HIGHEST else f"{low} to {high}"


_LOWEST, _HIGHEST = float("-inf"), float("inf")


def requirements(figures: dict[str, Any], limits: JudgeLimits | None = None) -> list[Requirement]:
    """What the project asks and the figures; the gaze is the head's where the truth knows both."""
    limits = JudgeLimits() if limits is None else limits
    overall = figures["overall"]
    gaze = "head" if overall["head_count"] else "gaze"
    middle, margin = limits.within_1sigma, limits.within_1sigma_tolerance
    return [
        Requirement("detection AP50", figures["detection"]["ap50"], limits.min_ap50, _HIGHEST, ""),
        Requirement(
            f"{gaze} direction error, median",
            overall[f"{gaze}_median_deg"],
            _LOWEST,
            limits.max_gaze_median_deg,
            "°",
        ),
        Requirement(
            f"{gaze} direction error, 90th percentile",
            overall[f"{gaze}_p90_deg"],
            _LOWEST,
            limits.max_gaze_p90_deg,
            "°",
        ),
        Requirement(
            "position error / range, median",
            overall["position_median"],
            _LOWEST,
            limits.max_position_median,
            "%",
        ),
        Requirement(
            "α mean absolute error", overall["awareness_mae"], _LOWEST, limits.max_awareness_mae, ""
        ),
        Requirement(
            "α ≥ 0.5 where the truth is 0",
            overall["false_aware"],
            _LOWEST,
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


# Columns of the tables by group: title, key, unit.
_COLUMNS: Final = (
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


def markdown_report(figures: dict[str, Any], limits: JudgeLimits | None = None) -> str:
    """The whole report."""
    settings, frames, overall = figures["settings"], figures["frames"], figures["overall"]
    detection, others = figures["detection"], figures["hidden_and_small_too"]
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
    lines += ["", *_table(("figure", "value", "asked", ""), _asked_rows(figures, limits))]
    rows = [
        ("found", f"{overall['found']} of {overall['people']} ({_number(overall['recall'], '%')})"),
        (
            "people reported where nobody is, or twice",
            f"{detection['false_positives']} "
            f"({_number(detection['false_positives_per_frame'], '')} a frame)",
        ),
        ("found people without a gaze", _number(overall["gaze_none"], "%")),
        ("found people without an α", _number(overall["awareness_none"], "%")),
        (
            "α mean absolute error, no α counted as 0",
            _number(overall["awareness_mae_none_as_0"], ""),
        ),
        (
            "α ≥ 0.5 where the truth is 0",
            f"{overall['false_aware_count']} of {overall['unaware_judged']} estimates "
            f"({overall['unaware_people']} such people)",
        ),
        (
            "the same, hidden and small people too",
            f"{others['false_aware_count']} of {others['unaware_judged']} "
            f"({_number(others['false_aware'], '%')})",
        ),
        (
            "people with true α ≥ 0.5 recognised",
            f"{_number(overall['aware_recognised'], '%')} of {overall['aware_people']}",
        ),
    ]
    lines += ["", *_table(("beside that", ""), rows), "", *_groups(figures)]
    return "\n".join(lines) + "\n"


def _asked_rows(figures: dict[str, Any], limits: JudgeLimits | None) -> list[tuple[str, ...]]:
    return [
        (each.name, _number(each.value, each.unit), each.asked, "yes" if each.met else "**no**")
        for each in requirements(figures, limits)
    ]


def _groups(figures: dict[str, Any]) -> list[str]:
    groups = [("all", figures["overall"]), *figures["by_facing"].items()]
    groups += [(f"{name} m", group) for name, group in figures["by_range_m"].items()]
    groups = [(name, group) for name, group in groups if group["people"]]
    columns = [
        column for column in _COLUMNS if any(group[column[1]] is not None for _, group in groups)
    ]
    rows = [
        (title, *(_number(group[key], unit) for _, group in groups)) for title, key, unit in columns
    ]
    return _table(("", *(name for name, _ in groups)), rows)


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """A Markdown table whose columns line up as plain text too."""
    everything = [header, *rows]
    widths = [max(len(row[column]) for row in everything) for column in range(len(header))]
    widths = [max(width, 3) for width in widths]

    def line(cells: tuple[str, ...]) -> str:
        padded = (cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        return "| " + " | ".join(padded) + " |"

    return [line(header), line(tuple("-" * width for width in widths)), *map(line, rows)]


def _number(value: float | None, unit: str) -> str:
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
