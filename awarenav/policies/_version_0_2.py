"""Policy files of version 0.2: their keys, the defaults that count, and how they are read."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Final

from perception.arrays import finite_number

from ..errors import AwarenavError

RAMP: Final = ("unaware_below", "aware_above")
SHAPES: Final = ("smoothstep", "linear", "logistic", "two_level")
KEPT: Final = {
    "inflation": (*RAMP, "unaware_radius_m", "aware_radius_m"),
    "speed": (*RAMP, "unaware_human_speed_mps", "aware_human_speed_mps"),
    "margins": ("uncertainty_sigmas", "unseen_sigmas"),
    "timing": (
        *("shrink_rate_mps", "fresh_within_s", "hold_s"),
        *("lost_rise_mps2", "stale_after_s", "stop_after_s"),
    ),
    "alerts": ("miss_within_m", "light_within_s", "voice_within_s", "horn_within_s"),
}
ALERTS: Final = {"unaware_below": "0.3", "repeat_after_s": "3 s", "quiet_s": "1 s"}
#: Keys of the policy itself and of its rules.
SECTIONS: Final = (*KEPT, "outline", "rules", "noticed", "filter")
RULES: Final = (
    *("turn_within_stop_deg", "people_turn_deg", "protective_field", "standing", "walking"),
    *("start_reserve", "zones", "near_cap"),
)
PEOPLE: Final = {
    "standing": (
        *("human_acceleration_mps2", "start_delay_s", "standing_below_mps"),
        "delay_from_tracks",
    ),
    "walking": ("human_acceleration_mps2", "turn_delay_s", "velocity_sigmas"),
}
OUTLINE: Final = (
    *(*RAMP, "shape", "steepness", "unaware_ahead_s", "aware_ahead_s", "longest_ahead_m"),
    *("sweep_s", "acceleration_density_m2ps3", "overconfidence_per_s"),
)
#: Keys that 0.2 did not know.
OF_TODAY: Final = ("reach", "noticed_counts_as", "attention")
# Defaults of 0.2 that another value would be more careful or less careful than.
HUMAN_SPEEDS: Final = {"unaware_human_speed_mps": 1.6, "aware_human_speed_mps": 0.7}
ACCELERATION_MPS2, DELAY_S, TURN_DEG, SHOWN_S = 2.0, 0.25, 90.0, 0.2


def mapping(value: Any, known: tuple[str, ...] | None, name: str) -> Mapping[str, Any]:
    """Return a mapping whose keys are known."""
    if not isinstance(value, Mapping):
        raise AwarenavError(f"{name} must be a mapping, got {value!r:.80}")
    if known is not None:
        require_known(value, known, name)
    return value


def require_known(given: Mapping[str, Any], known: tuple[str, ...], name: str) -> None:
    """Refuse a key that 0.2 did not know."""
    for key in given:
        if key not in known:
            raise AwarenavError(f"{name} of 0.2 has no key {key!r:.80}; it has {', '.join(known)}")


def number(given: Mapping[str, Any], key: str, default: float, name: str) -> float:
    """Return a number of the file, or its default."""
    return finite_number(f"{name}.{key}", given.get(key, default), AwarenavError, minimum=0.0)


def points_of(value: Any, name: str) -> list[tuple[float, float]]:
    """Return the points of a table, whose α rises and whose values do not."""
    if not isinstance(value, list) or not value:
        raise AwarenavError(f"{name} must hold [awareness, value] pairs, got {value!r:.80}")
    points = []
    for point in value:
        if not isinstance(point, list) or len(point) != 2:
            raise AwarenavError(f"{name} must hold [awareness, value] pairs, got {point!r:.80}")
        alpha = finite_number(f"{name} awareness", point[0], AwarenavError, minimum=0.0, maximum=1)
        points.append((alpha, finite_number(f"{name} value", point[1], AwarenavError)))
    for (alpha, high), (next_alpha, low) in pairwise(points):
        if not (next_alpha > alpha and low <= high):
            raise AwarenavError(f"{name}: awareness must rise and the values must not")
    return points
