"""Policies: ramps, refusals, YAML and presets."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from nav_policies import human_speeds, inflations, policies
from nav_scenes import finite
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.policies import InterpolatedHumanSpeed, InterpolatedInflation

ALPHA = finite(0.0, 1.0)
PRESETS = ("blind", "conservative", "balanced", "assertive")


class Constant:
    """A custom policy: neither a pydantic model nor a subclass."""

    def radius_m(self, awareness_lower: float) -> float:
        return 0.8

    def human_speed_mps(self, awareness_lower: float) -> float:
        return 1.2


@given(policy=policies(), low=ALPHA, high=ALPHA)
def test_radius_and_human_speed_never_grow_with_awareness(
    policy: AwarenessPolicy, low: float, high: float
) -> None:
    low, high = sorted((low, high))
    rounding = 1e-12
    assert policy.inflation.radius_m(high) <= policy.inflation.radius_m(low) + rounding
    assert policy.speed.human_speed_mps(high) <= policy.speed.human_speed_mps(low) + rounding


@given(inflation=inflations(), speed=human_speeds())
def test_both_ends_are_reached_exactly(
    inflation: InterpolatedInflation, speed: InterpolatedHumanSpeed
) -> None:
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
def test_a_policy_is_the_same_after_yaml(
    policy: AwarenessPolicy, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("policy") / "policy.yaml"
    policy.to_yaml(path)
    assert AwarenessPolicy.from_yaml(path) == policy


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_the_same_after_yaml(name: str, tmp_path: Path) -> None:
    policy = AwarenessPolicy.preset(name)
    policy.to_yaml(tmp_path / "policy.yaml")
    assert AwarenessPolicy.from_yaml(tmp_path / "policy.yaml") == policy


def test_presets_are_loaded_by_name() -> None:
    assert AwarenessPolicy.preset("balanced") == AwarenessPolicy()
    blind = AwarenessPolicy.preset("blind")
    for alpha in (0.0, 0.3, 0.7, 1.0):
        assert blind.inflation.radius_m(alpha) == AwarenessPolicy().inflation.radius_m(0.0)
        assert blind.speed.human_speed_mps(alpha) == AwarenessPolicy().speed.human_speed_mps(0.0)
    with pytest.raises(NavError, match="got 'blinded'; did you mean 'blind'") as refusal:
        AwarenessPolicy.preset("blinded")
    for name in PRESETS:
        assert repr(name) in str(refusal.value)


def test_a_file_that_sets_a_part_leaves_the_rest_at_its_defaults() -> None:
    policy = AwarenessPolicy.model_validate({"speed": {"aware_human_speed_mps": 0.5}})
    assert policy.speed.human_speed_mps(0.0) == AwarenessPolicy().speed.human_speed_mps(0.0)
    assert policy.speed.human_speed_mps(1.0) == 0.5
    assert policy.reach == AwarenessPolicy().reach
    assert AwarenessPolicy.model_validate({"reach": None}).reach is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inflation: {aware_radius: 0.5}", "did you mean 'aware_radius_m'"),
        ("timming: {}", "did you mean 'timing'"),
        ("margins: {clearance_m: 0.05}", "margins.clearance_m"),
        ("inflation: {aware_radius_m: 1.2}", "at most unaware_radius_m, got 1.2 m and 1 m"),
        ("speed: {aware_human_speed_mps: 2}", "at most unaware_human_speed_mps, got 2 m/s"),
        ("speed: {unaware_human_speed_mps: 11}", "speed.unaware_human_speed_mps"),
        ("speed: {unaware_below: 0.7}", "aware_above must exceed unaware_below"),
        ("inflation: {unaware_radius_m: .nan}", "inflation.unaware_radius_m"),
        ("timing: {stop_after_s: 0.4}", "stale_after_s <= stop_after_s must hold"),
        ("timing: {lost_rise_mps2: on}", "must be a number, got True"),
        ("inflation: 3", "inflation"),
        ("reach: {turn: 30}", "did you mean 'turn_deg'"),
        ("reach: {turn_deg: 181}", "reach.turn_deg"),
        ("reach: {time_constant_s: 0}", "reach.time_constant_s"),
        ("reach: {delay_s: -0.1}", "reach.delay_s"),
        ("noticed_counts_as: 1.5", "noticed_counts_as"),
        ("alerts: {horn_within_s: -1}", "alerts.horn_within_s"),
        # What 0.2 had is refused, with the keys that are valid.
        ("margins: {minimum_clearance_m: 0.2}", "did you mean 'clearance_m'"),
        ("inflation: {shape: linear}", "unknown key 'shape'"),
        ("rules: {standing: null}", "unknown key 'rules'"),
        ("outline: {sweep_s: 1}", "unknown key 'outline'"),
        ("timing: {shrink_after_s: 0.2}", "unknown key 'shrink_after_s'"),
        ("[1, 2]", "must hold a mapping"),
        ("inflation: {", "not valid YAML"),
    ],
)
def test_a_bad_file_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "policy.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(NavError) as refusal:
        AwarenessPolicy.from_yaml(path)
    assert message in str(refusal.value)
    assert "policy.yaml" in str(refusal.value)


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
