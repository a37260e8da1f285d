"""Forest plots: one interval per row on a common axis, with places in per cent of its length."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from ..measures import Interval, Metric
from ._geometry import TRACK_PX, labels_fit
from ._text import NOTHING, count, number, percent

# An estimate from less than this fraction of the most episodes does not stretch an axis.
_FEW: Final = 20
_HINTS: Final = {"lower": "less is better", "higher": "more is better", "neither": ""}


@dataclass(frozen=True, slots=True)
class Scale:
    """A linear axis from ``low`` to ``high``, ``low < high``."""

    low: float
    high: float

    @classmethod
    def over(cls, values: Iterable[float], *, zero: bool = False, pad: float = 0.06) -> Scale:
        """Return the axis that holds all values, with a margin at both ends.

        Args:
            values: finite; without any, the axis runs from 0 to 1.
            zero: the axis also holds 0, without a margin beyond it.
            pad: margin at each end, as a share of the length.
        """
        known = [*values, *([0.0] if zero else [])]
        low, high = (min(known), max(known)) if known else (0.0, 1.0)
        if high - low < 1e-9:
            low, high = (low, low + 1.0) if zero and low == 0.0 else (low - 0.5, high + 0.5)
        margin = pad * (high - low)
        return cls(
            low if zero and low == 0.0 else low - margin,
            high if zero and high == 0.0 else high + margin,
        )

    def place(self, value: float) -> float:
        """Return the place of a value in per cent; a value beyond an end lies at the end."""
        share = (value - self.low) / (self.high - self.low)
        return round(100.0 * min(max(share, 0.0), 1.0), 2)

    def ticks(self, most: int, length_px: float = math.inf) -> tuple[tuple[float, str], ...]:
        """Return round values in the axis: places in per cent, and texts.

        Args:
            most: largest number of values.
            length_px: length of the axis, along which the texts must not overlap.
        """
        for number_of in range(most, 1, -1):
            found = self._ticks(number_of)
            if labels_fit(found, length_px):
                return found
        return found[:1]

    def _ticks(self, most: int) -> tuple[tuple[float, str], ...]:
        step = _round_step((self.high - self.low) / max(most - 1, 1))
        decimals = max(0, -math.floor(math.log10(step) + 1e-9))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return tuple(
            (self.place(index * step), number(index * step, decimals))
            for index in range(first, last + 1)
        )


def _round_step(least: float) -> float:
    """Return the smallest of 1, 2, 5 times a power of ten that is not below ``least``."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(
        factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * 0.999
    )


@dataclass(frozen=True, slots=True)
class PanelRow:
    """One row of a panel; places are in per cent of its width, None for no data.

    Attributes:
        label: name of the row.
        look: number of the arm's colour and shape.
        value: the estimate as text.
        interval: ends of the interval as text.
        count: number of episodes or pairs, as text.
        place: place of the estimate.
        low: place of the interval's lower end.
        high: place of the interval's upper end.
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
    """A forest plot of one metric.

    Attributes:
        title: title of the metric.
        unit: unit of the numbers; numbers in per cent have their own sign.
        hint: the better direction in words; empty where the report names none.
        meaning: one sentence.
        rows: rows of the plot.
        ticks: places and texts of round values.
        zero: place of 0; None where 0 is not inside the axis.
    """

    title: str
    unit: str
    hint: str
    meaning: str
    rows: tuple[PanelRow, ...]
    ticks: tuple[tuple[float, str], ...]
    zero: float | None


def panel(
    metric: Metric,
    rows: Sequence[tuple[int, str, Interval]],
    *,
    scale: Scale | None = None,
    signed: bool = False,
) -> Panel:
    """Return the panel of a metric.

    Args:
        metric: the metric.
        rows: look, label and estimate of each row.
        scale: axis shared with other panels; default one for these rows, in per cent for shares.
        signed: write a plus before positive numbers, for differences.
    """
    factor = 100.0 if metric.share else 1.0
    known = [estimate for _, _, estimate in rows if estimate.known]
    if scale is None:
        scale = scale_over(known, factor, metric.from_zero)
    hint = _HINTS[metric.better] if metric.says_better else ""
    inside = scale.low < 0.0 < scale.high
    return Panel(
        metric.title,
        metric.unit,
        hint,
        metric.meaning,
        tuple(_panel_row(metric, scale, factor, signed, *row) for row in rows),
        scale.ticks(6, TRACK_PX),
        scale.place(0.0) if inside else None,
    )


def scale_over(estimates: Sequence[Interval], factor: float = 1.0, from_zero: bool = True) -> Scale:
    """Return the axis that holds all estimates with their intervals, and 0.

    An interval of few episodes would compress all others; the end of the axis cuts it off.
    """
    most = max((each.n for each in estimates), default=0)
    ends = [factor * end for each in estimates for end in _ends(each, most)]
    return Scale.over([end for end in ends if math.isfinite(end)], zero=from_zero)


def _ends(estimate: Interval, most: int) -> tuple[float, ...]:
    if estimate.n * _FEW < most:
        return (estimate.value,)
    return estimate.low, estimate.value, estimate.high


def _panel_row(
    metric: Metric,
    scale: Scale,
    factor: float,
    signed: bool,
    look: int,
    label: str,
    estimate: Interval,
) -> PanelRow:
    if not estimate.known:
        return PanelRow(label, look, NOTHING, "no data", "", None, None, None)

    def text(value: float) -> str:
        if metric.share:
            return percent(value, sign=signed)
        return number(value, metric.decimals, sign=signed)

    return PanelRow(
        label,
        look,
        text(estimate.value),
        f"{text(estimate.low)} to {text(estimate.high)}" if estimate.bounded else "not bounded",
        count(estimate.n),
        scale.place(factor * estimate.value),
        scale.place(factor * estimate.low) if estimate.bounded else None,
        scale.place(factor * estimate.high) if estimate.bounded else None,
    )
