"""The project's requirements for the metrics of estimates, and whether the metrics meet them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final, Literal

from ._intervals import UNBOUNDED, Ends

Verdict = Literal["yes", "no", "too few to tell"]

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
