"""Metrics, and a committed baseline to compare them with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from perception.documents import read_json

from .errors import AwarenavError
from .files import json_text, write_text

Direction = Literal["higher", "lower"]


@dataclass(frozen=True, slots=True)
class MeasuredValue:
    """A measured value.

    Attributes:
        name: unique in a baseline.
        value: measured.
        unit: of the value.
        direction: whether higher or lower values are better.
        tolerance: a value that is worse than the baseline by at most this share counts as equal.
    """

    name: str
    value: float
    unit: str
    direction: Direction
    tolerance: float

    def is_worse_than(self, baseline: MeasuredValue) -> bool:
        """Return whether the value is worse than the baseline by more than its tolerance."""
        if baseline.direction == "higher":
            return self.value < baseline.value * (1.0 - baseline.tolerance)
        return self.value > baseline.value * (1.0 + baseline.tolerance)


def write_baseline(path: Path, metrics: Iterable[MeasuredValue]) -> None:
    """Write metrics as a baseline file."""
    write_text(path, json_text({"metrics": [asdict(metric) for metric in metrics]}))


def read_baseline(path: Path) -> dict[str, MeasuredValue]:
    """Read a baseline file; return its metrics by name.

    Raises:
        AwarenavError: for a file that cannot be read or is not a baseline.
    """
    try:
        entries = read_json(path, AwarenavError)["metrics"]
        return {entry["name"]: MeasuredValue(**entry) for entry in entries}
    except (ValueError, KeyError, TypeError) as cause:
        raise AwarenavError(
            f"{path} is not a baseline: it must hold a list 'metrics' of name, value, unit, "
            f"direction and tolerance ({cause})"
        ) from cause


def worse_than(
    baseline: Mapping[str, MeasuredValue], metrics: Iterable[MeasuredValue]
) -> list[str]:
    """Return a line for each metric that is worse than its baseline by more than its tolerance."""
    return [
        f"{metric.name}: {metric.value:.3g} {metric.unit}, {baseline[metric.name].value:.3g} before"
        for metric in metrics
        if metric.name in baseline and metric.is_worse_than(baseline[metric.name])
    ]
