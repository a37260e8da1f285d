"""The search space of a tuning: policies that differ from a base policy in some numbers."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from awarenav.errors import did_you_mean
from nav_adapter import AwarenessPolicy, NavError
from perception.anthropometry import BODY_RADIUS_M
from perception.documents import parse_yaml, read_yaml
from tracking.config import complaints

from ...world.errors import SimError
from .._study import Range

# Lower bounds of all ranges: the floor.
_LOWER_BOUNDS: Final = {
    "inflation.aware_radius_m": BODY_RADIUS_M + 0.10,
    "inflation.unaware_radius_m": BODY_RADIUS_M + 0.10,
    # 99 % of the people recorded beside a robot set off no faster; the risk needs more.
    "speed.unaware_human_speed_mps": 1.05,
    "margins.clearance_m": 0.10,
    "margins.uncertainty_sigmas": 1.0,
    "filter.lower_bound_confidence": 0.5,
}
# Pairs of keys: the second value is lowered to the first.
_AT_MOST: Final = (
    ("inflation.unaware_radius_m", "inflation.aware_radius_m"),
    ("speed.unaware_human_speed_mps", "speed.aware_human_speed_mps"),
    ("filter.evidence_time_constant_s", "filter.unseen_time_constant_s"),
    ("filter.unseen_time_constant_s", "filter.no_face_time_constant_s"),
    ("timing.stop_after_s", "timing.stale_after_s"),
    ("timing.stale_after_s", "timing.fresh_within_s"),
)
# Pairs of keys: the second value is raised to this gap above the first.
_ABOVE: Final = (
    ("inflation.unaware_below", "inflation.aware_above", 0.05),
    ("speed.unaware_below", "speed.aware_above", 0.05),
)


class PolicyRange(Range):
    """The search range of a parameter of a policy.

    Attributes:
        also: other keys of the policy that get the same value.
    """

    also: tuple[str, ...] = ()


class PolicySpace:
    """The policies that differ from a base policy in some numbers.

    A part that the base policy has turned off, such as ``attention: null``, is not searched. Every
    point of the space is a valid policy: numbers that do not fit together are moved to the
    nearest that do. No policy is below the floor.

    Raises:
        SimError: a key that the policy does not have, or a range below the floor.
    """

    def __init__(
        self, base: AwarenessPolicy, ranges: Mapping[str, PolicyRange] | None = None
    ) -> None:
        self._base = _flat(base.model_dump(mode="json"))
        given = shipped_ranges() if ranges is None else ranges
        self.ranges = {key: each for key, each in given.items() if not self._is_off(key)}
        if not self.ranges:
            raise SimError("the policy has turned off every part that the ranges search")
        for key, each in self.ranges.items():
            for place in (key, *each.also):
                bound = _LOWER_BOUNDS.get(place)
                if bound is not None and each.low < bound - 1e-9:
                    raise SimError(
                        f"{place}: must not be searched below {bound:g}, got {each.low:g}"
                    )
                if not self._is_off(place) and not _is_number(self._base.get(place)):
                    numbers = [name for name, value in self._base.items() if _is_number(value)]
                    hint = did_you_mean(place, numbers)
                    raise SimError(f"the policy has no number {place!r}{hint}")
        for corner in (0.0, 1.0):
            self.policy({p: (1 - corner) * r.low + corner * r.high for p, r in self.ranges.items()})

    def base_parameters(self) -> dict[str, float]:
        """Return the point of the base policy, or the nearest point of the space."""
        return {key: each.clipped(self._base[key]) for key, each in self.ranges.items()}

    def policy(self, parameters: Mapping[str, float]) -> AwarenessPolicy:
        """Return the policy at a point of the space."""
        data = dict(self._base)
        for key, value in parameters.items():
            for place in (key, *self.ranges[key].also):
                if place in data:
                    data[place] = value
        for larger, smaller in _AT_MOST:
            if data.get(larger) is not None and data.get(smaller) is not None:
                data[smaller] = min(data[smaller], data[larger])
        for below, above, gap in _ABOVE:
            if data.get(below) is not None and data.get(above) is not None:
                data[above] = max(data[above], data[below] + gap)
        try:
            return AwarenessPolicy.model_validate(_nested(data))
        except ValidationError as cause:
            raise SimError(
                f"a range leads to a policy that cannot be: {complaints(cause)}"
            ) from cause
        except NavError as cause:
            raise SimError(f"a range leads to a policy that cannot be: {cause}") from cause

    def _is_off(self, place: str) -> bool:
        """Return whether the policy has null for a part that holds the dotted key."""
        parts = place.split(".")
        above = (".".join(parts[:depth]) for depth in range(1, len(parts)))
        without = self._base["without"]
        return any(self._base.get(part, part) is None or part in without for part in above)


def shipped_ranges() -> dict[str, PolicyRange]:
    """Return the ranges of ``ranges.yaml``."""
    text = (resources.files("sim_tests.search.tune") / "ranges.yaml").read_text("utf-8")
    return _parsed_ranges(parse_yaml(text, "ranges.yaml", SimError), "ranges.yaml")


def read_ranges(path: str | Path) -> dict[str, PolicyRange]:
    """Return the ranges of a file."""
    return _parsed_ranges(read_yaml(Path(path), SimError), str(path))


def _parsed_ranges(data: Any, source: str) -> dict[str, PolicyRange]:
    if not isinstance(data, dict) or not data:
        raise SimError(
            f"{source} must hold places in a policy and their ranges, such as "
            "inflation.aware_radius_m: {low: 0.4, high: 0.8}"
        )
    ranges = {}
    for key, each in data.items():
        try:
            ranges[str(key)] = PolicyRange.model_validate(each)
        except ValidationError as cause:
            raise SimError(f"{source}: {key}: {complaints(cause)}") from cause
    return ranges


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)


def _flat(data: Mapping[str, Any], start: str = "") -> dict[str, Any]:
    """Return nested values by dotted key; an empty part is a value."""
    flat: dict[str, Any] = {}
    for key, value in data.items():
        if isinstance(value, Mapping) and value:
            flat |= _flat(value, f"{start}{key}.")
        else:
            flat[start + key] = value
    return flat


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Return the nested values of which :func:`_flat` gives the dotted keys."""
    data: dict[str, Any] = {}
    for place, value in flat.items():
        *parents, last = place.split(".")
        node = data
        for key in parents:
            node = node.setdefault(key, {})
        node[last] = value
    return data
