"""Policies: ramps, YAML and presets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from nav_policies import human_speeds, inflations, policies
from nav_scenes import finite
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.policies import InterpolatedHumanSpeed, InterpolatedInflation
from tracking import AwarenessFilterConfig, TrackerConfig, TrackingError

ALPHA = finite(0.0, 1.0)
PRESETS = ("blind", "conservative", "balanced", "assertive")


class Constant:
    """A custom policy: neither a pydantic model nor a subclass."""

    def radius_m(self, awareness_lower: float) -> float:
        return 0.8

    def human_speed_mps(self, awareness_lower: float) -> float:
        return 1.2


@given(policy=policies(), low=ALPHA, high=ALPHA)
def test_radius_and_human_speed_never_grow_with_awareness(policy, low, high) -> None:
    low, high = sorted((low, high))
    rounding = 1e-12
    assert policy.inflation.radius_m(high) <= policy.inflation.radius_m(low) + rounding
    assert policy.speed.human_speed_mps(high) <= policy.speed.human_speed_mps(low) + rounding


@given(inflation=inflations(), speed=human_speeds())
def test_both_ends_are_reached_exactly(inflation, speed) -> None:
    for alpha in (0.0, inflation.unaware_below, float("nan")):
        assert inflation.radius_m(alpha) == inflation.unaware_radius_m
    for alpha in (0.0, speed.unaware_below, float("nan")):
        assert speed.human_speed_mps(alpha) == speed.unaware_human_speed_mps
    for alpha in (1.0, inflation.aware_above):
        assert inflation.radius_m(alpha) == inflation.aware_radius_m
    for alpha in (1.0, speed.aware_above):
        assert speed.human_speed_mps(alpha) == speed.aware_human_speed_mps


def test_the_ramp_in_closed_form() -> None:
    """A quarter of the way, a smoothstep has fallen by 3/16 − 2/64 = 5/32."""
    ramp = {"unaware_below": 0.2, "aware_above": 0.6}
    radius = InterpolatedInflation(unaware_radius_m=1.0, aware_radius_m=0.2, **ramp)
    assert radius.radius_m(0.3) == pytest.approx(1.0 - 0.8 * 5 / 32)
    assert radius.radius_m(0.4) == pytest.approx(0.6)
    assert radius.radius_m(0.5) == pytest.approx(0.2 + 0.8 * 5 / 32)
    speed = InterpolatedHumanSpeed(unaware_human_speed_mps=1.6, aware_human_speed_mps=0.0, **ramp)
    assert speed.human_speed_mps(0.3) == pytest.approx(1.6 * 27 / 32)


@given(policy=policies())
def test_a_policy_is_the_same_after_yaml(policy, tmp_path_factory) -> None:
    path = tmp_path_factory.mktemp("policy") / "policy.yaml"
    policy.to_yaml(path)
    assert AwarenessPolicy.from_yaml(path) == policy


def test_presets_are_loaded_by_name() -> None:
    assert AwarenessPolicy.preset("balanced") == AwarenessPolicy()
    blind = AwarenessPolicy.preset("blind")
    for alpha in (0.0, 0.3, 0.7, 1.0):
        assert blind.inflation.radius_m(alpha) == AwarenessPolicy().inflation.radius_m(0.0)
        assert blind.speed.human_speed_mps(alpha) == AwarenessPolicy().speed.human_speed_mps(0.0)
    with pytest.raises(NavError, match="'blinded' is unknown; did you mean 'blind'") as refusal:
        AwarenessPolicy.preset("blinded")
    for name in PRESETS:
        assert repr(name) in str(refusal.value)


def test_a_file_that_sets_a_part_leaves_the_rest_at_its_defaults() -> None:
    policy = AwarenessPolicy.model_validate({"speed": {"aware_human_speed_mps": 0.5}})
    assert policy.speed.human_speed_mps(0.0) == AwarenessPolicy().speed.human_speed_mps(0.0)
    assert policy.speed.human_speed_mps(1.0) == 0.5
    assert policy.reach == AwarenessPolicy().reach
    assert not AwarenessPolicy.model_validate({"without": ["reach"]}).applies("reach")
    with pytest.raises(ValueError, match="in the path"):
        AwarenessPolicy.model_validate({"without": ["in the path"]})


def test_custom_policy_objects_are_accepted_but_not_written(tmp_path: Path) -> None:
    own = Constant()
    policy = AwarenessPolicy(inflation=own, speed=own)
    assert policy.inflation is own
    assert policy.speed is own
    with pytest.raises(NavError, match="inflation is a Constant; only InterpolatedInflation"):
        policy.to_yaml(tmp_path / "policy.yaml")
    assert list(tmp_path.iterdir()) == []
    for wrong in (Constant, object(), None, 0.5):
        with pytest.raises(ValidationError, match="radius_m"):
            AwarenessPolicy(inflation=wrong)


@pytest.mark.parametrize("name", ["balanced", "assertive", "conservative", "blind"])
def test_a_rule_that_needs_the_tracker_has_what_it_needs(name: str) -> None:
    policy = AwarenessPolicy.preset(name)
    assert TrackerConfig.for_policy(policy) == TrackerConfig(awareness=policy.filter)


def test_any_object_with_the_needs_of_a_policy_will_do() -> None:
    @dataclass(frozen=True)
    class Mine:
        filter: AwarenessFilterConfig

    config = TrackerConfig.for_policy(Mine(AwarenessFilterConfig(missed_frame_s=0.2)))
    assert config.awareness.missed_frame_s == 0.2
    with pytest.raises(TrackingError, match="policy must be an AwarenessPolicy, got str"):
        TrackerConfig.for_policy("balanced")  # type: ignore[arg-type]
