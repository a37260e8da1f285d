"""Distributions that a scenario may put where a number stands."""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final, Protocol

from pydantic import Field, ValidationError, model_validator
from scipy.special import ndtr, ndtri

from awarenav.errors import not_one_of
from perception.arrays import finite_number
from tracking.config import StrictConfig

from ..world.errors import SimError

# Of a standard normal.
_UPPER_QUARTILE: Final = float(ndtri(0.75))
# Where a lognormal without limits of its own ends: at this quantile and at 1 minus it.
_TAIL: Final = 0.005


class Distribution(Protocol):
    """What a number is drawn from: by its quantile function, so one draw takes one uniform."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        ...

    @property
    def median(self) -> float:
        """The value that stands for the distribution where nothing is drawn."""
        ...

    def quantile(self, share: float) -> float:
        """The value below which ``share`` (0 to 1) of all draws lie."""
        ...


class Uniform(StrictConfig):
    """Equally likely everywhere from ``low`` to ``high``."""

    error: ClassVar[type[ValueError]] = SimError

    low: float
    high: float

    @model_validator(mode="after")
    def _in_order(self) -> Uniform:
        _check_order(self.low, self.high)
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.low, self.high

    @property
    def median(self) -> float:
        """The middle."""
        return self.quantile(0.5)

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        share = _checked(share)
        return (1.0 - share) * self.low + share * self.high


class Normal(StrictConfig):
    """A normal distribution cut off at ``low`` and ``high``; ``mean`` and ``std`` before that."""

    error: ClassVar[type[ValueError]] = SimError

    mean: float
    std: float = Field(gt=0.0)
    low: float
    high: float

    @model_validator(mode="after")
    def _in_order(self) -> Normal:
        _check_order(self.low, self.high)
        _check_within("mean", self.mean, self.low, self.high)
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.low, self.high

    @property
    def median(self) -> float:
        """Half of all draws lie below it."""
        return self.quantile(0.5)

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        return _cut_quantile(share, self.mean, self.std, self.low, self.high)


class LogNormal(StrictConfig):
    """A lognormal distribution by its median and quartiles, cut off at ``low`` and ``high``.

    Quartiles that are not symmetric about the median on a logarithmic scale give their mean spread.
    Without limits it ends at its 0.5 and 99.5 % quantiles.
    """

    error: ClassVar[type[ValueError]] = SimError

    #: Before the cut.
    median: float = Field(gt=0.0)
    quartiles: tuple[float, float]
    low: float | None = Field(default=None, gt=0.0)
    high: float | None = Field(default=None, gt=0.0)

    @model_validator(mode="after")
    def _in_order(self) -> LogNormal:
        first, third = self.quartiles
        if not 0.0 < first < self.median < third:
            raise ValueError(
                "quartiles must be above 0 and lie on both sides of the median "
                f"{self.median:g}, got {first:g} and {third:g}"
            )
        _check_order(*self.bounds)
        _check_within("median", self.median, *self.bounds)
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        reach = self._log_std * float(ndtri(1.0 - _TAIL))
        low = self.median * math.exp(-reach) if self.low is None else self.low
        high = self.median * math.exp(reach) if self.high is None else self.high
        return low, high

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        low, high = self.bounds
        logarithm = _cut_quantile(
            share, math.log(self.median), self._log_std, math.log(low), math.log(high)
        )
        return min(max(math.exp(logarithm), low), high)

    @property
    def _log_std(self) -> float:
        first, third = self.quartiles
        return math.log(third / first) / (2.0 * _UPPER_QUARTILE)


class Integers(StrictConfig):
    """The whole numbers from ``low`` to ``high``, both included, equally likely."""

    error: ClassVar[type[ValueError]] = SimError

    low: int
    high: int

    @model_validator(mode="after")
    def _in_order(self) -> Integers:
        _check_order(self.low, self.high)
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.low, self.high

    @property
    def median(self) -> float:
        """The middle one, the upper of two."""
        return self.quantile(0.5)

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        count = self.high - self.low + 1
        return self.low + min(int(_checked(share) * count), count - 1)


class Choice(StrictConfig):
    """One of some numbers, equally likely; a number that is listed twice is twice as likely."""

    error: ClassVar[type[ValueError]] = SimError

    values: tuple[float, ...] = Field(min_length=1)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return min(self.values), max(self.values)

    @property
    def median(self) -> float:
        """The middle one in order of size, the upper of two."""
        return self.quantile(0.5)

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        count = len(self.values)
        return sorted(self.values)[min(int(_checked(share) * count), count - 1)]


_KINDS: Final[dict[str, type[StrictConfig]]] = {
    "uniform": Uniform,
    "normal": Normal,
    "lognormal": LogNormal,
    "integers": Integers,
    "choice": Choice,
}
#: What may stand in a file: ``{uniform: {low: 1.0, high: 2.0}}`` and so on.
DISTRIBUTIONS: Final = tuple(_KINDS)


def read_distribution(path: str, kind: str, data: Any) -> Distribution:
    """The distribution that ``{kind: data}`` describes.

    Args:
        path: where it stands, for messages.
        kind: one of :data:`DISTRIBUTIONS`.
        data: its settings: a mapping, for ``choice`` a list.

    Raises:
        SimError: naming the path for an unknown kind, unknown keys or values that are not possible.
    """
    if kind not in _KINDS:
        raise SimError(f"{path}: {not_one_of('a distribution', kind, DISTRIBUTIONS)}")
    if kind == "choice":
        if not isinstance(data, list | tuple):
            raise SimError(f"{path}: choice must be a list of numbers, got {data!r}")
        data = {"values": data}
    elif not isinstance(data, dict):
        keys = ", ".join(f"{key}: ..." for key in _KINDS[kind].model_fields)
        raise SimError(f"{path}: {kind} must be a mapping {{{keys}}}, got {data!r}")
    try:
        distribution: Any = _KINDS[kind].model_validate(data)
    except ValidationError as cause:
        raise SimError(f"{path}: {kind}: {error_text(cause)}") from cause
    found: Distribution = distribution
    return found


def error_text(error: ValidationError, root: str = "") -> str:
    """Each complaint of pydantic as ``path: what is wrong``, in one line."""
    said = []
    for each in error.errors(include_url=False):
        path = ".".join([root, *map(str, each["loc"])]).strip(".")
        what = each["msg"].removeprefix("Value error, ")
        if each["type"] in ("float_type", "int_type") and isinstance(each["input"], dict):
            kind = next(iter(each["input"]), None)
            what = "must be a number, or a distribution: " + not_one_of(
                "its kind", kind, DISTRIBUTIONS
            )
        elif each["type"] not in ("value_error", "missing"):
            what = f"{what}, got {each['input']!r}"
        said.append(f"{path}: {what}" if path else what)
    return "; ".join(said)


def _check_order(low: float, high: float) -> None:
    if not low < high:
        raise ValueError(f"low must be below high, got {low:g} and {high:g}")


def _check_within(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ValueError(f"{name} must lie from low {low:g} to high {high:g}, got {value:g}")


def _checked(share: float) -> float:
    return finite_number("share", share, SimError, minimum=0.0, maximum=1.0)


def _cut_quantile(share: float, mean: float, std: float, low: float, high: float) -> float:
    """Quantile of a normal distribution that is cut off at ``low`` and ``high``."""
    first, last = float(ndtr((low - mean) / std)), float(ndtr((high - mean) / std))
    value = mean + std * float(ndtri(first + _checked(share) * (last - first)))
    return min(max(value, low), high)
