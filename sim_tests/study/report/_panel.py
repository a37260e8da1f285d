"""An axis: values to places in per cent of its length, and round numbers to mark it with.

Intervals side by side: what the page draws as a small plot with a row an arm.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from ..measures import Interval
from ._arm import Arm
from ._measure import Measure
from ._text import NOTHING, count, number, percent


@dataclass(frozen=True, slots=True)
class Scale:
    """A linear axis from ``low`` to ``high``, ``low < high``."""

    low: float
    high: float

    @classmethod
    def over(cls, values: Iterable[float], *, zero: bool = False, pad: float = 0.06) -> Scale:
        """The axis that holds all values with some room about them.

        Args:
            values: finite; without any the axis runs from 0 to 1.
            zero: also holds 0, without room beyond it.
            pad: room at each end, as a share of the length.
        """
        known = [*values, *([0.0] if zero else [])]
        low, high = (min(known), max(known)) if known else (0.0, 1.0)
        if high - low < 1e-9:
            low, high = (low, low + 1.0) if zero and low == 0.0 else (low - 0.5, high + 0.5)
        room = pad * (high - low)
        return cls(
            low if zero and low == 0.0 else low - room,
            high if zero and high == 0.0 else high + room,
        )

    def place(self, value: float) -> float:
        """Where a value lies, in per cent; values beyond an end lie at it."""
        share = (value - self.low) / (self.high - self.low)
        return round(100.0 * min(max(share, 0.0), 1.0), 2)

    def ticks(self, most: int = 5) -> tuple[tuple[float, str], ...]:
        """At most so many round values in the axis: places in per cent and texts."""
        step = _round_step((self.high - self.low) / max(most - 1, 1))
        decimals = max(0, -math.floor(math.log10(step) + 1e-9))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return tuple(
            (self.place(index * step), number(index * step, decimals))
            for index in range(first, last + 1)
        )


def _round_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is not below ``least``."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(
        factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * 0.999
    )


# Estimates from less than this part of the episodes of others do not stretch an axis.
_FEW: Final = 20


@dataclass(frozen=True, slots=True)
class PanelRow:
    """One interval: places in per cent of the panel's width, None for no data.

    Attributes:
        label: name of the arm.
        look: of the arm's mark.
        value: the estimate as text.
        interval: its ends as text.
        count: of episodes or pairs, as text.
        place: of the estimate.
        low: place of the interval's end.
        high: place of the interval's end.
    """

    label: str
    look: int
    value: str
    interval: str
    count: str
    place: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class Panel:
    """A plot of intervals.

    Attributes:
        title: of the measure.
        unit: of the numbers; those in per cent carry their sign.
        hint: which way is better, empty where neither is.
        meaning: one sentence.
        rows: one an arm.
        ticks: place and text of round values.
        zero: place of 0, None where the axis has none inside.
    """

    title: str
    unit: str
    hint: str
    meaning: str
    rows: tuple[PanelRow, ...]
    ticks: tuple[tuple[float, str], ...]
    zero: float | None


def panel(
    measure: Measure,
    rows: Sequence[tuple[Arm, str, Interval]],
    *,
    scale: Scale | None = None,
    signed: bool = False,
) -> Panel:
    """Draw up a panel.

    Args:
        measure: what is shown.
        rows: arm, label and estimate of each row.
        scale: shared with other panels; default one for these rows, in per cent for shares.
        signed: writes a plus before gains, for differences.
    """
    factor = 100.0 if measure.share else 1.0
    known = [estimate for _, _, estimate in rows if estimate.known]
    if scale is None:
        scale = scale_over(known, factor, measure.from_zero)
    hint = {"less": "less is better", "more": "more is better"}.get(measure.better, "")
    inside = scale.low < 0.0 < scale.high
    return Panel(
        measure.title,
        measure.unit,
        hint,
        measure.meaning,
        tuple(_row(measure, scale, factor, signed, *row) for row in rows),
        scale.ticks(6),
        scale.place(0.0) if inside else None,
    )


def scale_over(estimates: Sequence[Interval], factor: float = 1.0, from_zero: bool = True) -> Scale:
    """The axis that holds all estimates, their intervals unless they are much wider, and 0.

    The interval of a few episodes would squeeze all the others; it is cut off at the axis's end.
    """
    most = max((each.n for each in estimates), default=0)
    ends = [factor * end for each in estimates for end in _ends(each, most)]
    return Scale.over([end for end in ends if math.isfinite(end)], zero=from_zero)


def _ends(estimate: Interval, most: int) -> tuple[float, ...]:
    if estimate.n * _FEW < most:
        return (estimate.value,)
    return estimate.low, estimate.value, estimate.high


def _row(
    measure: Measure,
    scale: Scale,
    factor: float,
    signed: bool,
    arm: Arm,
    label: str,
    estimate: Interval,
) -> PanelRow:
    if not estimate.known:
        return PanelRow(label, arm.look, NOTHING, "no data", "", None, None, None)

    def text(value: float) -> str:
        if measure.share:
            return percent(value, sign=signed)
        return number(value, measure.decimals, sign=signed)

    return PanelRow(
        label,
        arm.look,
        text(estimate.value),
        f"{text(estimate.low)} to {text(estimate.high)}" if estimate.bounded else "not bounded",
        count(estimate.n),
        scale.place(factor * estimate.value),
        scale.place(factor * estimate.low) if estimate.bounded else None,
        scale.place(factor * estimate.high) if estimate.bounded else None,
    )
