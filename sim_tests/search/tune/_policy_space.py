"""The policies among which a tuning searches."""

from __future__ import annotations

import copy
import difflib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, ClassVar, Final

import yaml
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy, NavError
from perception.anthropometry import BODY_RADIUS_M

from ...world.errors import SimError
from .._search import Range

#: ISO 13855: nobody who has not noticed the robot counts as slower.
WALKING_SPEED_MPS: Final = 1.6
# No search reaches below these, whatever a file of ranges says.
_LEAST: Final = {
    "inflation.aware_radius_m": BODY_RADIUS_M + 0.10,
    "inflation.unaware_radius_m": BODY_RADIUS_M + 0.10,
    "speed.unaware_human_speed_mps": WALKING_SPEED_MPS,
    "margins.minimum_clearance_m": 0.10,
    "margins.separation_clearance_m": 0.10,
    "margins.uncertainty_sigmas": 1.0,
    "filter.lower_bound_confidence": 0.5,
}
# The second is moved to no more than the first.
_AT_MOST: Final = (
    ("inflation.unaware_radius_m", "inflation.aware_radius_m"),
    ("speed.unaware_human_speed_mps", "speed.aware_human_speed_mps"),
    ("speed.aware_human_speed_mps", "speed.watching_human_speed_mps"),
    ("filter.evidence_time_constant_s", "filter.unseen_time_constant_s"),
    ("filter.unseen_time_constant_s", "filter.no_face_time_constant_s"),
    ("outline.unaware_ahead_s", "outline.aware_ahead_s"),
    ("timing.stop_after_s", "timing.stale_after_s"),
    ("timing.stale_after_s", "timing.fresh_within_s"),
)
# The second is moved to at least so much above the first.
_ABOVE: Final = (
    ("inflation.unaware_below", "inflation.aware_above", 0.05),
    ("speed.unaware_below", "speed.aware_above", 0.05),
    ("speed.aware_above", "speed.watching_above", 0.05),
    ("outline.unaware_below", "outline.aware_above", 0.05),
    ("rules.zones.stop_within_m", "rules.zones.full_speed_beyond_m", 0.1),
)
# Parts that a policy may lack; searching in one brings it in.
_OPTIONAL: Final = {
    "rules.near_cap": {"within_m": 1.5, "speed_mps": 1.5},
    "rules.zones": {"stop_within_m": 0.0, "full_speed_beyond_m": 0.5},
}


class PolicyRange(Range):
    """Where a parameter of a policy is searched.

    Attributes:
        also: other places in the policy that get the same value.
    """

    error: ClassVar[type[ValueError]] = SimError

    also: tuple[str, ...] = ()


class PolicySpace:
    """The policies that differ from a base policy in some numbers.

    Every point of the space is a valid policy: numbers that do not go together are moved to the
    nearest that do. None reaches below the floor, and none takes the unaware for slower than the
    walking speed of ISO 13855.

    Args:
        base: everything that is not searched.
        ranges: where to search, by dotted place in the policy's file; None for the shipped ranges.

    Raises:
        SimError: for a place that the policy does not have, or a range below the floor.
    """

    def __init__(
        self, base: AwarenessPolicy, ranges: Mapping[str, PolicyRange] | None = None
    ) -> None:
        self.ranges = dict(shipped_ranges() if ranges is None else ranges)
        self._data: dict[str, Any] = base.model_dump(mode="json")
        for path, each in self.ranges.items():
            for place in (path, *each.also):
                least = _LEAST.get(place)
                if least is not None and each.low < least - 1e-9:
                    raise SimError(
                        f"{place}: must not be searched below {least:g}, got {each.low:g}"
                    )
                for part, values in _OPTIONAL.items():
                    if place.startswith(part + ".") and _get(self._data, part) is None:
                        _put(self._data, part, dict(values))
                if not isinstance(_get(self._data, place), float | int):
                    near = difflib.get_close_matches(place, _numbers(self._data), n=1)
                    hint = f"; did you mean {near[0]!r}?" if near else ""
                    raise SimError(f"the policy has no number {place!r}{hint}")
        for corner in (0.0, 1.0):
            self.policy({p: (1 - corner) * r.low + corner * r.high for p, r in self.ranges.items()})

    def base_parameters(self) -> dict[str, float]:
        """Where the base policy lies, or the nearest point of the space."""
        return {path: each.clipped(_get(self._data, path)) for path, each in self.ranges.items()}

    def policy(self, parameters: Mapping[str, float]) -> AwarenessPolicy:
        """The policy at a point of the space.

        Raises:
            SimError: for values that no policy may have.
        """
        data = copy.deepcopy(self._data)
        for path, value in parameters.items():
            for place in (path, *self.ranges[path].also):
                _put(data, place, value)
        for larger, smaller in _AT_MOST:
            if _both(data, larger, smaller):
                _put(data, smaller, min(_get(data, smaller), _get(data, larger)))
        for below, above, gap in _ABOVE:
            if _both(data, below, above):
                _put(data, above, max(_get(data, above), _get(data, below) + gap))
        ceiling_m = data["margins"]["maximum_radius_m"]
        if ceiling_m is not None:
            data["margins"]["maximum_radius_m"] = max(
                ceiling_m, _get(data, "inflation.unaware_radius_m") or 0.0
            )
        try:
            return AwarenessPolicy.model_validate(data)
        except (ValidationError, NavError) as cause:
            raise SimError(f"a range leads to a policy that cannot be: {cause}") from cause


def shipped_ranges() -> dict[str, PolicyRange]:
    """The ranges of ``ranges.yaml``."""
    text = (resources.files("sim_tests.search.tune") / "ranges.yaml").read_text("utf-8")
    return _ranges(text, "ranges.yaml")


def read_ranges(path: str | Path) -> dict[str, PolicyRange]:
    """The ranges of a file.

    Raises:
        SimError: naming the file and what is wrong.
    """
    try:
        return _ranges(Path(path).read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as cause:
        raise SimError(f"cannot read {path}: {cause}") from cause


def _ranges(text: str, source: str) -> dict[str, PolicyRange]:
    try:
        data = yaml.safe_load(text)
    except yaml.YAMLError as cause:
        raise SimError(f"{source} is not valid YAML: {cause}") from cause
    if not isinstance(data, dict) or not data:
        raise SimError(
            f"{source} must hold places in a policy and their ranges, such as "
            "inflation.aware_radius_m: {low: 0.4, high: 0.8}"
        )
    ranges = {}
    for path, each in data.items():
        try:
            ranges[str(path)] = PolicyRange.model_validate(each)
        except ValidationError as cause:
            raise SimError(f"{source}: {path}: {cause}") from cause
    return ranges


def _get(data: Mapping[str, Any], place: str) -> Any:
    node: Any = data
    for key in place.split("."):
        if not isinstance(node, Mapping) or key not in node:
            return None
        node = node[key]
    return node


def _both(data: Mapping[str, Any], *places: str) -> bool:
    """Whether the policy has a value in all of these places."""
    return all(_get(data, place) is not None for place in places)


def _put(data: dict[str, Any], place: str, value: Any) -> None:
    *way, last = place.split(".")
    node = data
    for key in way:
        if not isinstance(node.get(key), dict):
            return
        node = node[key]
    if last in node:
        node[last] = value


def _numbers(data: Mapping[str, Any], start: str = "") -> list[str]:
    found = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            found += _numbers(value, f"{start}{key}.")
        elif isinstance(value, float | int) and not isinstance(value, bool):
            found.append(f"{start}{key}")
    return found
