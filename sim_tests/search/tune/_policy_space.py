"""The search space of a tuning: policies that differ from a base policy in some numbers."""

from __future__ import annotations

import copy
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
from .._optimizer import Range

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

    Args:
        base: the policy that gives all other numbers.
        ranges: search ranges, by dotted key of the policy file; None for the shipped ranges.

    Raises:
        SimError: a key that the policy does not have, or a range below the floor.
    """

    def __init__(
        self, base: AwarenessPolicy, ranges: Mapping[str, PolicyRange] | None = None
    ) -> None:
        self._data: dict[str, Any] = base.model_dump(mode="json")
        given = shipped_ranges() if ranges is None else ranges
        self.ranges = {key: each for key, each in given.items() if not _is_off(self._data, key)}
        if not self.ranges:
            raise SimError("the policy has turned off every part that the ranges search")
        for key, each in self.ranges.items():
            for place in (key, *each.also):
                bound = _LOWER_BOUNDS.get(place)
                if bound is not None and each.low < bound - 1e-9:
                    raise SimError(
                        f"{place}: must not be searched below {bound:g}, got {each.low:g}"
                    )
                if _is_off(self._data, place):
                    continue
                if not isinstance(_get(self._data, place), float | int):
                    hint = did_you_mean(place, _number_keys(self._data))
                    raise SimError(f"the policy has no number {place!r}{hint}")
        for corner in (0.0, 1.0):
            self.policy({p: (1 - corner) * r.low + corner * r.high for p, r in self.ranges.items()})

    def base_parameters(self) -> dict[str, float]:
        """Return the point of the base policy, or the nearest point of the space."""
        return {key: each.clipped(_get(self._data, key)) for key, each in self.ranges.items()}

    def policy(self, parameters: Mapping[str, float]) -> AwarenessPolicy:
        """Return the policy at a point of the space.

        Raises:
            SimError: values that no policy may have.
        """
        data = copy.deepcopy(self._data)
        for key, value in parameters.items():
            for place in (key, *self.ranges[key].also):
                _put(data, place, value)
        for larger, smaller in _AT_MOST:
            if _has_both(data, larger, smaller):
                _put(data, smaller, min(_get(data, smaller), _get(data, larger)))
        for below, above, gap in _ABOVE:
            if _has_both(data, below, above):
                _put(data, above, max(_get(data, above), _get(data, below) + gap))
        try:
            return AwarenessPolicy.model_validate(data)
        except ValidationError as cause:
            raise SimError(
                f"a range leads to a policy that cannot be: {complaints(cause)}"
            ) from cause
        except NavError as cause:
            raise SimError(f"a range leads to a policy that cannot be: {cause}") from cause


def shipped_ranges() -> dict[str, PolicyRange]:
    """Return the ranges of ``ranges.yaml``."""
    text = (resources.files("sim_tests.search.tune") / "ranges.yaml").read_text("utf-8")
    return _parsed_ranges(parse_yaml(text, "ranges.yaml", SimError), "ranges.yaml")


def read_ranges(path: str | Path) -> dict[str, PolicyRange]:
    """Return the ranges of a file.

    Raises:
        SimError: an unusable file; the message names it and the error.
    """
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


def _get(data: Mapping[str, Any], place: str) -> Any:
    """Return the value at a dotted key; None without one."""
    node: Any = data
    for key in place.split("."):
        if not isinstance(node, Mapping) or key not in node:
            return None
        node = node[key]
    return node


def _is_off(data: Mapping[str, Any], place: str) -> bool:
    """Return whether the policy has null for a part that holds the dotted key."""
    *parts, _ = place.split(".")
    node: Any = data
    for part in parts:
        if not isinstance(node, Mapping) or part not in node:
            return False
        node = node[part]
        if node is None:
            return True
    return False


def _has_both(data: Mapping[str, Any], *places: str) -> bool:
    """Return whether the policy has a value in all of these places."""
    return all(_get(data, place) is not None for place in places)


def _put(data: dict[str, Any], place: str, value: Any) -> None:
    """Set the value at a dotted key, if the policy has that key."""
    *parents, last = place.split(".")
    node = data
    for key in parents:
        if not isinstance(node.get(key), dict):
            return
        node = node[key]
    if last in node:
        node[last] = value


def _number_keys(data: Mapping[str, Any], start: str = "") -> list[str]:
    """Return the dotted keys of all numbers."""
    found = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            found += _number_keys(value, f"{start}{key}.")
        elif isinstance(value, float | int) and not isinstance(value, bool):
            found.append(f"{start}{key}")
    return found
