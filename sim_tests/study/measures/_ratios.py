"""Figures of many episodes that are ratios of two sums, not means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ._metrics import Metric

_PER_HOUR: Final = 3600.0


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio of two columns of ``episodes.csv``, each summed over the episodes.

    Attributes:
        metric: name, title and direction of the figure.
        column: the column that is summed.
        over: the column whose sum it is divided by; an episode without a number is left out.
        factor: multiplies the ratio.
    """

    metric: Metric
    column: str
    over: str
    factor: float = 1.0


#: Ratios of sums by the name of their figure, as docs/metrics.md defines them.
RATIOS: Final = {
    each.metric.name: each
    for each in (
        Ratio(
            Metric(
                "requests_per_hour",
                "Requests per hour",
                "",
                "lower",
                "Requests for attention, divided by the simulated time.",
                decimals=1,
            ),
            "requests",
            "duration_s",
            _PER_HOUR,
        ),
        Ratio(
            Metric(
                "answered_share",
                "Share of requests answered",
                "%",
                "higher",
                "Share of requests whose person began to look at the robot within 2.5 s.",
                share=True,
            ),
            "requests_answered",
            "requests",
        ),
        Ratio(
            Metric(
                "needless_share",
                "Share of needless requests",
                "%",
                "lower",
                "Share of requests to somebody who, a second later, neither set the speed limit "
                "nor had looked.",
                share=True,
            ),
            "requests_needless",
            "requests",
        ),
    )
}
