"""Distributions in the place of numbers in a scenario: found by path, read, and filled in."""

from __future__ import annotations

import copy
import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, Protocol

from pydantic import Field, ValidationError, model_validator
from scipy.special import ndtr, ndtri

from awarenav.errors import not_one_of
from perception.arrays import finite_number
from tracking.config import complaint

from ..world.config import SimConfig
from ..world.errors import SimError

# Third quartile of a standard normal distribution.
_UPPER_QUARTILE: Final = float(ndtri(0.75))
# A lognormal distribution without limits ends at this quantile and at 1 minus it.
_TAIL: Final = 0.005
# Keys whose numbers may vary. Hall, camera and duration are the same in every episode.
_VARIABLE: Final = ("people", "robot")


class Distribution(Protocol):
    """A distribution that is drawn from by its quantile function: one draw takes one uniform."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        ...

    @property
    def median(self) -> float:
        """Value that stands for the distribution where nothing is drawn."""
        ...

    def quantile(self, share: float) -> float:
        """Return the value below which ``share`` (0 to 1) of all draws lie."""
        ...


class _Limited(SimConfig):
    """Base of the distributions that always have the limits ``low`` and ``high``."""

    low: float
    high: float

    @model_validator(mode="after")
    def _in_order(self) -> _Limited:
        _check_order(self.low, self.high)
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.low, self.high

    @property
    def median(self) -> float:
        """Value below which half of all draws lie; the upper of two whole numbers."""
        return self.quantile(0.5)

    @abstractmethod
    def quantile(self, share: float) -> float:
        """Return the value below which ``share`` (0 to 1) of all draws lie."""


class Uniform(_Limited):
    """A uniform distribution from ``low`` to ``high``."""

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        share = _checked_share(share)
        return (1.0 - share) * self.low + share * self.high


class Normal(_Limited):
    """A normal distribution cut off at ``low`` and ``high``.

    ``mean`` and ``std`` are those before the cut.
    """

    mean: float
    std: float = Field(gt=0.0)

    @model_validator(mode="after")
    def _mean_within(self) -> Normal:
        _check_within("mean", self.mean, self.low, self.high)
        return self

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        return _truncated_normal_quantile(share, self.mean, self.std, self.low, self.high)


class LogNormal(SimConfig):
    """A lognormal distribution by its median and quartiles, cut off at ``low`` and ``high``.

    The spread is that of the two quartiles on a logarithmic scale; they need not be symmetric about
    the median. Without limits the distribution ends at its 0.5 % and 99.5 % quantiles.
    """

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
        logarithm = _truncated_normal_quantile(
            share, math.log(self.median), self._log_std, math.log(low), math.log(high)
        )
        return min(max(math.exp(logarithm), low), high)

    @property
    def _log_std(self) -> float:
        first, third = self.quartiles
        return math.log(third / first) / (2.0 * _UPPER_QUARTILE)


class Integers(_Limited):
    """The whole numbers from ``low`` to ``high``, both included, equally likely."""

    low: int
    high: int

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        count = self.high - self.low + 1
        return self.low + min(int(_checked_share(share) * count), count - 1)


class Choice(SimConfig):
    """A choice among listed numbers, equally likely; one listed twice is twice as likely."""

    values: tuple[float, ...] = Field(min_length=1)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return min(self.values), max(self.values)

    @property
    def median(self) -> float:
        """Middle value in order of size; the upper of two."""
        return self.quantile(0.5)

    def quantile(self, share: float) -> float:
        """See :class:`Distribution`."""
        count = len(self.values)
        return sorted(self.values)[min(int(_checked_share(share) * count), count - 1)]


_KINDS: Final[dict[str, type[SimConfig]]] = {
    "uniform": Uniform,
    "normal": Normal,
    "lognormal": LogNormal,
    "integers": Integers,
    "choice": Choice,
}
#: Names of the distributions in a file: ``{uniform: {low: 1.0, high: 2.0}}`` and so on.
DISTRIBUTIONS: Final = tuple(_KINDS)


def read_distribution(path: str, kind: str, data: Any) -> Distribution:
    """Return the distribution that ``{kind: data}`` describes.

    Args:
        path: its path in the file, for messages.
        kind: one of :data:`DISTRIBUTIONS`.
        data: its settings: a mapping, for ``choice`` a list.

    Raises:
        SimError: naming the path, for an unknown kind, unknown keys or impossible values.
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


def find_parameters(data: Mapping[str, Any], source: str) -> dict[str, Distribution]:
    """Return the distributions in a scenario's data by dotted path, as ``"people.0.speed_mps"``.

    Raises:
        SimError: for an impossible distribution, and for one outside people and robot.
    """
    found: dict[str, Distribution] = {}
    for path, kind, settings in _distributions_in(data, (), source):
        dotted = ".".join(path)
        if any("." in key for key in path):
            raise SimError(f"{source}: unknown key in {dotted!r}: no key has a dot")
        if path[0] not in _VARIABLE:
            raise SimError(
                f"{source}: {dotted}: only numbers under {', '.join(_VARIABLE)} may be "
                f"distributions, got {kind}"
            )
        found[dotted] = read_distribution(f"{source}: {dotted}", kind, settings)
    return found


def with_numbers(
    data: Mapping[str, Any],
    parameters: Mapping[str, Distribution],
    values: Mapping[str, float],
    source: str,
) -> dict[str, Any]:
    """Return the data with a value, or the median, in place of each distribution.

    Raises:
        SimError: for a path that is no parameter, and for a value that is not finite.
    """
    for path in values:
        if path not in parameters:
            raise SimError(f"{source}: {not_one_of('a parameter', path, parameters)}")
    filled: dict[str, Any] = copy.deepcopy(dict(data))
    for path, distribution in parameters.items():
        value = values.get(path)
        if value is None:
            value = distribution.median
        number = finite_number(path, value, SimError)
        filled = _with_number(filled, path.split("."), number)
    return filled


def error_text(error: ValidationError) -> str:
    """Return what is wrong with a scenario, on one line, as for any config.

    A mapping in the place of a number was meant as a distribution.
    """
    found = []
    for each in error.errors(include_url=False):
        given = next(iter(each["input"]), None) if isinstance(each["input"], dict) else None
        if each["type"] in ("float_type", "int_type") and given is not None:
            if given in DISTRIBUTIONS:
                found.append(f"{'.'.join(map(str, each['loc']))}: must be a number, got {given}")
                continue
            kind = not_one_of("its kind", given, DISTRIBUTIONS)
            path = ".".join(map(str, each["loc"]))
            found.append(f"{path}: must be a number, or a distribution: {kind}")
        else:
            found.append(complaint(each))
    return "; ".join(found)


def _check_order(low: float, high: float) -> None:
    if not low < high:
        raise ValueError(f"low must be below high, got {low:g} and {high:g}")


def _check_within(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ValueError(f"{name} must lie from low {low:g} to high {high:g}, got {value:g}")


def _checked_share(share: float) -> float:
    return finite_number("share", share, SimError, minimum=0.0, maximum=1.0)


def _truncated_normal_quantile(
    share: float, mean: float, std: float, low: float, high: float
) -> float:
    """Return a quantile of the normal distribution that is cut off at ``low`` and ``high``."""
    first, last = float(ndtr((low - mean) / std)), float(ndtr((high - mean) / std))
    value = mean + std * float(ndtri(first + _checked_share(share) * (last - first)))
    return min(max(value, low), high)


def _distributions_in(
    node: Any, path: tuple[str, ...], source: str
) -> Iterator[tuple[tuple[str, ...], str, Any]]:
    """Yield path, kind and settings of every distribution in a tree of mappings and lists."""
    if isinstance(node, Mapping):
        kinds = [key for key in node if key in DISTRIBUTIONS]
        if kinds and path:
            if len(node) > 1:
                raise SimError(
                    f"{source}: {'.'.join(path)}: a distribution must be the only key, got "
                    f"{', '.join(map(str, node))}"
                )
            yield path, kinds[0], node[kinds[0]]
            return
        for key, value in node.items():
            yield from _distributions_in(value, (*path, str(key)), source)
    elif isinstance(node, list | tuple):
        for number, value in enumerate(node):
            yield from _distributions_in(value, (*path, str(number)), source)


def _with_number(node: Any, path: Sequence[str], value: float) -> Any:
    """Return a tree of mappings and lists with a number at a path."""
    if not path:
        return value
    key, *rest = path
    if isinstance(node, Mapping):
        return {**node, key: _with_number(node.get(key), rest, value)}
    return [
        _with_number(each, rest, value) if at == int(key) else each for at, each in enumerate(node)
    ]
