from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import finite
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.policies import (
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    SafetyMargins,
    TimeBehaviour,
)

ALPHA = finite(0.0, 1.0)


class Constant:
    """An own policy: neither a model nor a subclass of anything."""

    def radius_m(self, awareness_lower: float) -> float:
        return 0.8

    def human_speed_mps(self, awareness_lower: float) -> float:
        return 1.2


@st.composite
def ramps(draw: st.DrawFn) -> dict[str, object]:
    low = draw(finite(0.0, 0.98))
    return {
        "unaware_below": low,
        "aware_above": draw(finite(low + 0.01, 1.0)),
        "shape": draw(st.sampled_from(["linear", "smoothstep"])),
    }


@st.composite
def policies(draw: st.DrawFn) -> AwarenessPolicy:
    aware_radius, aware_speed = draw(finite(0.05, 2.0)), draw(finite(0.0, 2.0))
    fresh = draw(finite(0.05, 0.3))
    return AwarenessPolicy(
        inflation=InterpolatedInflation(
            unaware_radius_m=aware_radius + draw(finite(0.0, 3.0)),
            aware_radius_m=aware_radius,
            **draw(ramps()),
        ),
        speed=InterpolatedHumanSpeed(
            unaware_human_speed_mps=aware_speed + draw(finite(0.0, 2.0)),
            aware_human_speed_mps=aware_speed,
            **draw(ramps()),
        ),
        margins=SafetyMargins(minimum_clearance_m=draw(finite(0.1, 1.0))),
        timing=TimeBehaviour(fresh_within_s=fresh, stale_after_s=fresh + draw(finite(0.0, 1.0))),
    )


@given(policy=policies(), low=ALPHA, high=ALPHA)
def test_awareness_never_enlarges_and_never_hastens(
    policy: AwarenessPolicy, low: float, high: float
) -> None:
    low, high = sorted((low, high))
    rounding = 1e-12
    assert policy.inflation.radius_m(high) <= policy.inflation.radius_m(low) + rounding
    assert policy.speed.human_speed_mps(high) <= policy.speed.human_speed_mps(low) + rounding


@given(policy=policies())
def test_both_ends_are_reached_exactly(policy: AwarenessPolicy) -> None:
    inflation, speed = policy.inflation, policy.speed
    assert inflation.radius_m(0.0) == inflation.unaware_radius_m
    assert inflation.radius_m(1.0) == inflation.aware_radius_m
    assert speed.human_speed_mps(0.0) == speed.unaware_human_speed_mps
    assert speed.human_speed_mps(1.0) == speed.aware_human_speed_mps


def test_shapes() -> None:
    linear = InterpolatedInflation(shape="linear", unaware_below=0.2, aware_above=0.6)
    smooth = linear.model_copy(update={"shape": "smoothstep"})
    assert linear.radius_m(0.3) == pytest.approx(1.0 - 0.25 * 0.55)
    assert smooth.radius_m(0.3) == pytest.approx(1.0 - (3 * 0.25**2 - 2 * 0.25**3) * 0.55)
    assert smooth.radius_m(0.4) == pytest.approx(linear.radius_m(0.4))
    assert linear.radius_m(float("nan")) == 1.0


@given(policy=policies())
def test_yaml_round_trip(policy: AwarenessPolicy, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("policy") / "policy.yaml"
    policy.to_yaml(path)
    assert AwarenessPolicy.from_yaml(path) == policy


def test_presets() -> None:
    assert AwarenessPolicy.preset("balanced") == AwarenessPolicy()
    blind = AwarenessPolicy.preset("blind")
    for alpha in (0.0, 0.3, 0.7, 1.0):
        assert blind.inflation.radius_m(alpha) == AwarenessPolicy().inflation.radius_m(0.0)
        assert blind.speed.human_speed_mps(alpha) == AwarenessPolicy().speed.human_speed_mps(0.0)
    with pytest.raises(NavError, match=r"'balanced', 'blind', got 'blinded'; did you mean 'blind'"):
        AwarenessPolicy.preset("blinded")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inflation: {aware_radius: 0.5}", "did you mean 'aware_radius_m'"),
        ("timming: {}", "did you mean 'timing'"),
        ("margins: {minimum_clearance_m: 0.05}", "margins.minimum_clearance_m"),
        ("inflation: {aware_radius_m: 1.2}", "at most unaware_radius_m, got 1.2 m and 1 m"),
        ("speed: {aware_human_speed_mps: 2}", "at most unaware_human_speed_mps, got 2 m/s"),
        ("speed: {unaware_below: 0.7}", "aware_above must exceed unaware_below"),
        ("inflation: {unaware_radius_m: .nan}", "inflation.unaware_radius_m"),
        ("timing: {stop_after_s: 0.4}", "stale_after_s <= stop_after_s must hold"),
        ("inflation: 3", "inflation"),
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


def test_own_policy_objects_are_taken_but_not_written(tmp_path: Path) -> None:
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
