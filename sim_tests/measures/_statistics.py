"""What can be said from many episodes: the names that other rooms use."""

from __future__ import annotations

from ._bootstrap import bootstrap_interval, ratio_interval, ratio_intervals
from ._interval import Interval
from ._pairs import (
    paired,
    paired_difference,
    violates_more,
    violation_excess,
    violation_excess_of_time,
    won_back,
)
from ._proportions import proportion_interval, zero_of_n_upper
from ._summary import Summary, summarise

__all__ = [
    "Interval",
    "Summary",
    "bootstrap_interval",
    "paired",
    "paired_difference",
    "proportion_interval",
    "ratio_interval",
    "ratio_intervals",
    "summarise",
    "violates_more",
    "violation_excess",
    "violation_excess_of_time",
    "won_back",
    "zero_of_n_upper",
]
