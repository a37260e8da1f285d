"""One policy against another on the same scenarios and seeds."""

from __future__ import annotations

from dataclasses import dataclass

from ._interval import Interval


@dataclass(frozen=True, slots=True)
class Comparison:
    """One policy against the baseline over one part of the paired episodes.

    Attributes:
        variant: the policy.
        baseline: compared with.
        part: a scenario or an attention; empty for all.
        pairs: how many.
        won_back: share of the time lost by the baseline that is won back.
        time_lost_s: mean difference to the baseline; negative is faster.
        violation_excess: longer violation of the margin, relative to that of the baseline.
        violation_excess_of_time: the same relative to the baseline's duration.
        violates_more: share of pairs with a longer violation.
        min_separation_m: mean difference of the smallest separation.
    """

    variant: str
    baseline: str
    part: str
    pairs: int
    won_back: Interval
    time_lost_s: Interval
    violation_excess: Interval
    violation_excess_of_time: Interval
    violates_more: Interval
    min_separation_m: Interval
