"""Estimates with intervals: exact for shares, bootstrapped within strata, and over pairs."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from awarenav.intervals import UNBOUNDED, bootstrap_ends, share_interval
from perception.arrays import FloatArray, finite_array, finite_number

from ...world.errors import SimError
from ._metrics import COLUMNS
from ._record import EpisodeRecord

#: A narrow space that breaks no line, before a sign of per cent.
THIN: Final = "\N{NARROW NO-BREAK SPACE}"
#: What stands for a number that there is not.
NOTHING: Final = "–"
#: With fewer pairs, the bootstrap interval is too narrow, and no effect counts as shown.
FEW_PAIRS: Final = 20
RESAMPLES: Final = 4000
# Resamples are drawn in batches of so many numbers, to bound the memory.
_NUMBERS_PER_BATCH: Final = 2_000_000
# Shares this near to 0 or 1 are 0 or 1.
_ROUNDING: Final = 1e-12
# Violation times that differ by less count as equal.
_SAME_TIME_S: Final = 1e-6

Pair = tuple[EpisodeRecord, EpisodeRecord]


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its confidence interval.

    Attributes:
        value: the estimate; NaN when there is none.
        low: lower end of the interval, −inf where the data do not bound it.
        high: upper end, +inf where the data do not bound it.
        n: number of episodes, or of pairs of episodes, behind the estimate.
        left_out: number of episodes or pairs to which the metric does not apply.
    """

    value: float
    low: float
    high: float
    n: int
    left_out: int = 0

    @property
    def known(self) -> bool:
        """True if there is an estimate."""
        return math.isfinite(self.value)

    @property
    def bounded(self) -> bool:
        """True if the interval is finite on both sides."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    @property
    def count(self) -> int:
        """Number of episodes behind a share."""
        return round(self.value * self.n) if self.n else 0

    def share_text(self) -> str:
        """Return a share of episodes as ``"0 of 23 (≤ 12 %)"``: the count, and the interval."""
        if not self.n:
            return NOTHING
        ends = f"{100.0 * self.low:.1f}–{100.0 * self.high:.1f}{THIN}%"
        if self.value == 0.0:
            ends = f"≤ {percent(self.high)}"
        elif self.value == 1.0:
            ends = f"≥ {percent(self.low)}"
        return f"{self.count} of {self.n} ({ends})"

    def text(self, decimals: int = 2, scale: float = 1.0) -> str:
        """Return ``"1.23 [1.01, 1.50]"``, ``"1.23 [?]"`` without bounds, a dash without a value.

        Args:
            decimals: of the value and both ends.
            scale: multiplies the value and both ends; 100 for per cent.
        """
        if not self.known:
            return NOTHING
        value = number_text(self.value * scale, decimals)
        if not self.bounded:
            return f"{value} [?]"
        low, high = (number_text(bound * scale, decimals) for bound in (self.low, self.high))
        return f"{value} [{low}, {high}]"


def number_text(value: float | None, decimals: int = 2) -> str:
    """Return a number with the given decimals, without the sign of a negative zero.

    None, NaN and infinity are a dash.
    """
    if value is None or not math.isfinite(value):
        return NOTHING
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def percent(share: float) -> str:
    """Return a share in per cent, with more decimals near 0 and 1: 0.9975 is no 100 %."""
    if not math.isfinite(share):
        return NOTHING
    rest = min(abs(share), abs(1.0 - abs(share)))
    decimals = 0 if rest >= 0.1 or rest < _ROUNDING else 1 if rest >= 0.01 else 2
    return f"{100.0 * share:.{decimals}f}{THIN}%"


def zero_of_n_upper(n: int, level: float = 0.95) -> float:
    """Return the upper bound of a share after 0 of n independent trials: 1 − (1 − level)^(1/n).

    This is the one-sided bound of Clopper and Pearson (1934), about 3/n at 95 %; 1 for n = 0.

    Raises:
        SimError: n < 0, or level outside (0, 1).
    """
    level = _checked_level(level, n, n)
    return 1.0 if n == 0 else float(1.0 - (1.0 - level) ** (1.0 / n))


def proportion_interval(count: int, n: int, level: float = 0.95) -> Interval:
    """Return the share ``count / n`` with its exact interval (Clopper and Pearson 1934).

    The interval is two-sided. For a count of 0 or n, its one free end is the one-sided bound of
    :func:`zero_of_n_upper`.

    Raises:
        SimError: not 0 ≤ count ≤ n, or level outside (0, 1).
    """
    level = _checked_level(level, count, n)
    if n == 0:
        return Interval(float("nan"), 0.0, 1.0, 0)
    if count == 0:
        return Interval(0.0, 0.0, zero_of_n_upper(n, level), n)
    if count == n:
        return Interval(1.0, 1.0 - zero_of_n_upper(n, level), 1.0, n)
    return Interval(count / n, *share_interval(count, n, 0.5 * (1.0 - level)), n)


def _checked_level(level: float, count: int = 0, n: int = 0) -> float:
    """Return the level; refuse a count that is not between 0 and n."""
    if not 0 <= count <= n:
        raise SimError(f"a share must be of 0 to n episodes, got {count} of {n}")
    level = finite_number("level", level, SimError, minimum=0.0, exclusive_minimum=True)
    if level >= 1.0:
        raise SimError(f"level must lie in (0, 1), got {level:g}")
    return level


def bootstrap_interval(
    values: Any,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    over: Any = None,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> Interval:
    """Return the mean of (N,) values with its bootstrap interval; with ``over``, a ratio of sums.

    :func:`ratio_intervals` describes the method and the other arguments.
    """
    top = finite_array("values", values, ("N",), SimError)
    bottom = np.ones_like(top) if over is None else over
    bottom = finite_array("over", bottom, top.shape, SimError)
    columns = (top[:, None], bottom[:, None])
    interval = ratio_intervals(*columns, rng, level, strata=strata, resamples=resamples)[0]
    return replace(interval, n=len(top))


def ratio_intervals(
    numerators: Any,
    denominators: Any,
    rng: np.random.Generator,
    level: float = 0.95,
    *,
    strata: Sequence[Hashable] | None = None,
    resamples: int = RESAMPLES,
) -> tuple[Interval, ...]:
    """Return M ratios of sums over the same N episodes, each with its bootstrap interval.

    The interval is bias-corrected and accelerated (BCa; Efron 1987). The acceleration comes from
    the empirical influence (Davison and Hinkley 1997, section 5.4). Resamples are drawn within
    strata: of n episodes, n − 1 are drawn with replacement and weighted n/(n − 1) (Rao and Wu
    1988). The variance of the plain bootstrap is too small by (n − 1)/n, which matters with few
    seeds per scenario. Strata of one episode are joined.

    Args:
        numerators: (N, M) finite.
        denominators: (N, M) finite; 1 for a mean, and 0 over 0 for an episode to which the metric
            does not apply.
        rng: draws the resamples.
        level: confidence of the interval, in (0, 1).
        strata: a label for each of the N episodes, or None for a single stratum.
        resamples: number of resamples.

    Returns:
        M intervals. The value is NaN without episodes, or where the sum of denominators is not
        positive. The interval is unbounded for a single episode, or where more resamples have such
        a sum than the interval may leave out.

    Raises:
        SimError: numbers that are not finite, or another number of labels than of episodes.
    """
    top = finite_array("numerators", numerators, ("N", "M"), SimError)
    bottom = finite_array("denominators", denominators, top.shape, SimError)
    level = _checked_level(level)
    groups = _groups(strata, len(top))
    tops, bottoms = _resampled_sums((top, bottom), rng, groups, resamples)
    applies = ((top != 0.0) | (bottom != 0.0)).sum(axis=0).tolist()

    def interval(m: int) -> Interval:
        total = float(bottom[:, m].sum())
        if total <= 0.0:
            return Interval(np.nan, -np.inf, np.inf, applies[m])
        value = float(top[:, m].sum()) / total
        usable = bottoms[:, m] > 1e-12 * total
        resampled = np.where(usable, tops[:, m] / np.where(usable, bottoms[:, m], 1.0), np.nan)
        acceleration = _acceleration(top[:, m] - value * bottom[:, m], groups)
        return resampled_interval(value, resampled, applies[m], level, acceleration)

    return tuple(interval(m) for m in range(top.shape[1]))


def resampled_means(
    values: Any, rng: np.random.Generator, *, strata: Sequence[Hashable] | None = None
) -> FloatArray:
    """Return the (B, M) means of (N, M) finite values in B resamples of the N episodes.

    Resamples are drawn as for :func:`ratio_intervals`. All columns share them, so figures that are
    computed from several columns are paired. With a single episode all means are 0.

    Raises:
        SimError: values that are not finite, or another number of labels than of episodes.
    """
    checked = finite_array("values", values, ("N", "M"), SimError)
    (sums,) = _resampled_sums((checked,), rng, _groups(strata, len(checked)), RESAMPLES)
    means: FloatArray = sums / max(len(checked), 1)
    return means


def resampled_interval(
    value: float, resampled: FloatArray, n: int, level: float = 0.95, acceleration: float = 0.0
) -> Interval:
    """Return a figure of n episodes with the bias-corrected interval of its (B,) resamples.

    The interval is unbounded for a single episode, or where more resamples have no figure (NaN)
    than the interval may leave out.
    """
    usable, tail = np.isfinite(resampled), 0.5 * (1.0 - level)
    if not np.isfinite(value) or n < 2 or np.mean(~usable) > tail:
        return Interval(value, *UNBOUNDED, n)
    return Interval(value, *bootstrap_ends(value, resampled[usable], acceleration, tail), n)


def _groups(strata: Sequence[Hashable] | None, n: int) -> list[NDArray[np.intp]]:
    """Return the rows of each stratum, at least two per stratum; none for a single episode.

    Strata of one row are joined; a single one joins the smallest stratum.
    """
    labels = [None] * n if strata is None else list(strata)
    if len(labels) != n:
        raise SimError(f"strata must be {n} labels, one per value, got {len(labels)}")
    if n < 2:
        return []
    rows: dict[Hashable, list[int]] = {}
    for row, label in enumerate(labels):
        rows.setdefault(label, []).append(row)
    groups = [group for group in rows.values() if len(group) > 1]
    singles = [row for group in rows.values() if len(group) == 1 for row in group]
    if len(singles) == 1 and groups:
        min(groups, key=len).extend(singles)
    elif singles:
        groups.append(singles)
    return [np.array(group) for group in groups]


def _resampled_sums(
    columns: Sequence[FloatArray],
    rng: np.random.Generator,
    groups: Sequence[NDArray[np.intp]],
    resamples: int,
) -> list[FloatArray]:
    """Return the (B, M) sums of each of the (N, M) columns in the same resamples."""
    sums = [np.zeros((resamples, each.shape[1])) for each in columns]
    for group in groups:
        for rows, weights in _draws(len(group), resamples, rng):
            for total, each in zip(sums, columns, strict=True):
                total[rows] += weights @ each[group]
    return sums


def _draws(
    size: int, resamples: int, rng: np.random.Generator
) -> Iterator[tuple[slice, FloatArray]]:
    """Yield batches of resamples: their rows, and the (batch, size) weight of each episode."""
    batch = max(_NUMBERS_PER_BATCH // size, 1)
    for start in range(0, resamples, batch):
        count = min(batch, resamples - start)
        drawn = rng.integers(0, size, (count, size - 1)) + size * np.arange(count)[:, None]
        times = np.bincount(drawn.ravel(), minlength=count * size).reshape(count, size)
        weights: FloatArray = times * np.float64(size / (size - 1))
        yield slice(start, start + count), weights


def _acceleration(residuals: FloatArray, groups: Sequence[NDArray[np.intp]]) -> float:
    """Return a sixth of the skewness of the empirical influence; its scale cancels."""
    largest = float(np.abs(residuals).max())
    if largest < np.finfo(np.float64).tiny:
        return 0.0
    second = third = 0.0
    for group in groups:
        influence = (residuals[group] - residuals[group].mean()) / largest
        second += float((influence**2).sum())
        third += float((influence**3).sum())
    return third / (6.0 * second**1.5) if second > 0.0 else 0.0


def paired(base: Iterable[EpisodeRecord], other: Iterable[EpisodeRecord]) -> tuple[Pair, ...]:
    """Return the pairs of episodes of the same scenario, version and seed, ordered by these.

    Both episodes start with the same people; what they do later may depend on the robot.

    Raises:
        SimError: one side has an episode twice.
    """
    first, second = _by_task(base), _by_task(other)
    return tuple((first[task], second[task]) for task in sorted(first.keys() & second.keys()))


def paired_difference(
    base: Iterable[EpisodeRecord],
    other: Iterable[EpisodeRecord],
    field: str,
    rng: np.random.Generator | None = None,
    level: float = 0.95,
    *,
    over: str = "",
) -> Interval:
    """Return the mean of ``other`` − ``base`` over pairs, or its ratio to ``base``, with interval.

    With ``over``, it is Σ (``other`` − ``base``) of a field over Σ of a field of ``base``: no mean
    of shares, in which an episode that lost almost no time would weigh as much as any other.
    Resamples are drawn within scenarios. Pairs in which a field is None on either side are left out
    and counted.

    Args:
        base: episodes of one policy.
        other: episodes of the other policy.
        field: a number, count or flag of :class:`EpisodeRecord`.
        rng: draws the resamples; None for a generator with seed 0.
        level: confidence of the interval.
        over: the field of ``base`` whose sum the differences are divided by; empty for their mean.

    Returns:
        The figure; NaN if ``over`` is 0 in every episode of ``base``.

    Raises:
        SimError: one side has an episode twice, or the field holds no number.
    """
    if field not in COLUMNS or COLUMNS[field].kind == "text":
        raise SimError(f"field must be a number of an episode, got {field!r}")
    pairs = paired(base, other)
    kept = _with_numbers(pairs, field, over or field)
    interval = bootstrap_interval(
        [getattr(second, field) - getattr(first, field) for first, second in kept],
        np.random.default_rng(0) if rng is None else rng,
        level,
        over=[getattr(first, over) for first, _ in kept] if over else None,
        strata=[first.task[:2] for first, _ in kept],
    )
    return replace(interval, left_out=len(pairs) - len(kept))


def violates_more(
    base: Iterable[EpisodeRecord], other: Iterable[EpisodeRecord], level: float = 0.95
) -> Interval:
    """Return the share of pairs in which ``other`` violates the margin longer than ``base``.

    Its interval is exact.
    """
    pairs = _with_numbers(paired(base, other), "violation_time_s")
    more = sum(
        second.violation_time_s > first.violation_time_s + _SAME_TIME_S for first, second in pairs
    )
    return proportion_interval(more, len(pairs), level)


def _with_numbers(pairs: Sequence[Pair], *names: str) -> list[Pair]:
    return [
        pair
        for pair in pairs
        if all(
            not record.error and getattr(record, name) is not None
            for record in pair
            for name in names
        )
    ]


def _by_task(records: Iterable[EpisodeRecord]) -> dict[tuple[str, int, int], EpisodeRecord]:
    found: dict[tuple[str, int, int], EpisodeRecord] = {}
    for record in records:
        if record.task in found:
            raise SimError(
                f"scenario {record.scenario!r}, seed {record.seed} is there twice for policy "
                f"{record.policy!r}: pairs need one episode each"
            )
        found[record.task] = record
    return found
