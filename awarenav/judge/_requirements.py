"""The project's requirements for the metrics of estimates, and whether the metrics meet them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from ._intervals import UNBOUNDED, Ends
from ._judge import JudgeLimits

Verdict = Literal["yes", "no", "too few to tell"]


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


def requirements(metrics: dict[str, Any], limits: JudgeLimits | None = None) -> list[Requirement]:
    """Return the project's requirements with the metrics.

    The gaze is the direction of the head if the truth has both head and eyes.
    """
    limits = JudgeLimits() if limits is None else limits
    gaze = "head" if metrics["overall"]["head_count"] else "gaze"
    middle, margin = limits.within_1sigma, limits.within_1sigma_tolerance

    def asked(
        name: str,
        key: str,
        low: float,
        high: float,
        unit: str,
        group: str = "overall",
    ) -> Requirement:
        ends = metrics["intervals"][group].get(key, UNBOUNDED)
        return Requirement(name, metrics[group][key], low, high, unit, ends)

    def at_most(name: str, key: str, high: float, unit: str) -> Requirement:
        return asked(name, key, -math.inf, high, unit)

    return [
        asked("detection AP50", "ap50", limits.min_ap50, math.inf, "", "detection"),
        at_most(
            f"{gaze} direction error, median",
            f"{gaze}_median_deg",
            limits.max_gaze_median_deg,
            "°",
        ),
        at_most(
            f"{gaze} direction error, 90th percentile",
            f"{gaze}_p90_deg",
            limits.max_gaze_p90_deg,
            "°",
        ),
        at_most(
            "position error / range, median", "position_median", limits.max_position_median, "%"
        ),
        at_most("α mean absolute error", "awareness_mae", limits.max_awareness_mae, ""),
        at_most("α ≥ 0.5 where the truth is 0", "false_aware", limits.max_false_aware, "%"),
        asked(
            "error of α within 1σ (truth or estimate in (0, 1))",
            "awareness_within_1sigma",
            middle - margin,
            middle + margin,
            "%",
        ),
    ]


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
