"""One thing that a falsification may change about a scenario."""

from __future__ import annotations

from dataclasses import dataclass

from ..search._range import Range


@dataclass(frozen=True, slots=True)
class Lever:
    """One thing that may be changed.

    Attributes:
        range: within human limits.
        neutral: where the scenario is as it was written.
    """

    range: Range
    neutral: float

    @classmethod
    def of(cls, low: float, high: float, neutral: float) -> Lever:
        """A lever from ``low`` to ``high``, widened to hold ``neutral``."""
        return cls(Range(low=min(low, neutral), high=max(high, neutral)), neutral)
