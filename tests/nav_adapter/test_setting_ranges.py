"""Defaults and ranges of the settings of a policy: what runs where nobody has chosen."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel

from nav_adapter import AwarenessPolicy
from nav_adapter.policies import AttentionRules

#: Default, lowest and highest value; those in OPEN are just out of range.
RANGES: dict[str, dict[str, tuple[float, float, float]]] = {
    "inflation": {
        "unaware_below": (0.1, 0.0, 1.0),
        "aware_above": (0.6, 0.0, 1.0),
        "unaware_radius_m": (1.0, 0.0, 10.0),
        "aware_radius_m": (0.45, 0.0, 10.0),
    },
    "speed": {
        "unaware_below": (0.1, 0.0, 1.0),
        "aware_above": (0.6, 0.0, 1.0),
        "unaware_human_speed_mps": (1.5, 0.0, 10.0),
        "aware_human_speed_mps": (0.23, 0.0, 10.0),
    },
    "reach": {
        "time_constant_s": (0.54, 0.05, 5.0),
        "delay_s": (0.15, 0.0, 2.0),
        "turn_deg": (30.0, 0.0, 180.0),
    },
    "margins": {
        "clearance_m": (0.1, 0.1, 2.0),
        "uncertainty_sigmas": (2.0, 0.0, 5.0),
        "unseen_sigmas": (2.5, 0.0, 5.0),
    },
    "timing": {
        "shrink_rate_mps": (0.5, 0.0, 5.0),
        "fresh_within_s": (0.25, 0.0, 1.0),
        "hold_s": (1.0, 0.0, 10.0),
        "lost_rise_mps2": (0.7, 0.0, 10.0),
        "stale_after_s": (0.5, 0.0, 5.0),
        "stop_after_s": (1.5, 0.0, 10.0),
    },
    "alerts": {
        "miss_within_m": (0.5, 0.0, 5.0),
        "light_within_s": (5.0, 0.0, 30.0),
        "voice_within_s": (3.5, 0.0, 30.0),
        "horn_within_s": (2.0, 0.0, 30.0),
    },
    "attention": {
        "min_gain_s": (2.0, 0.0, 10.0),
        "pause_s": (2.0, 1.0, 60.0),
        "per_minute": (6, 1, 60),
        "within_m": (8.0, 0.0, 30.0),
    },
}
OPEN = {
    ("inflation", "aware_above", "low"),
    ("inflation", "unaware_below", "high"),
    ("inflation", "unaware_radius_m", "low"),
    ("inflation", "aware_radius_m", "low"),
    ("speed", "aware_above", "low"),
    ("speed", "unaware_below", "high"),
    ("attention", "within_m", "low"),
    *(("timing", name, "low") for name in RANGES["timing"] if name != "hold_s"),
}

KEYS = ("minimum", "maximum")


@pytest.mark.parametrize("part", RANGES)
def test_defaults_and_ranges(part: str) -> None:
    settings: BaseModel = getattr(AwarenessPolicy(attention=AttentionRules()), part)
    found = {}
    for name, schema in type(settings).model_json_schema()["properties"].items():
        one: dict[str, Any] = {**schema, **schema.get("anyOf", [{}])[0]}
        if one["type"] == "array":
            continue
        low, high = (one.get(key, one.get(f"exclusive{key.title()}")) for key in KEYS)
        found[name] = (getattr(settings, name), low, high)
        for key, end in zip(KEYS, ("low", "high"), strict=True):
            is_open = f"exclusive{key.title()}" in one
            assert is_open == ((part, name, end) in OPEN), (name, end)
    assert found == RANGES[part]
