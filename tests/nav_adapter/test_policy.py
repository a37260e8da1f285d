"""Policies: shapes, tables, rules, YAML and refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from nav_policies import human_speeds, inflations, policies
from nav_scenes import finite
from pydantic import ValidationError

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.policies import (
    DistanceZones,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    NearCap,
    TableHumanSpeed,
    TableInflation,
)

ALPHA = finite(0.0, 1.0)


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
    inflation: InterpolatedInflation | TableInflation,
    speed: InterpolatedHumanSpeed | TableHumanSpeed,
) -> None:
    if isinstance(inflation, TableInflation):
        assert inflation.radius_m(0.0) == inflation.table_m[0][1]
        assert inflation.radius_m(1.0) == inflation.table_m[-1][1]
    else:
        assert inflation.radius_m(0.0) == inflation.unaware_radius_m
        assert inflation.radius_m(1.0) == inflation.aware_radius_m
    if isinstance(speed, InterpolatedHumanSpeed):
        assert speed.human_speed_mps(0.0) == speed.unaware_human_speed_mps
        watching_mps = speed.watching_human_speed_mps
        wanted = speed.aware_human_speed_mps if watching_mps is None else watching_mps
        assert speed.human_speed_mps(1.0) == wanted


def test_watching_people_have_a_lower_speed_than_aware_ones() -> None:
    speed = InterpolatedHumanSpeed(
        aware_human_speed_mps=0.35, watching_above=0.8, watching_human_speed_mps=0.05
    )
    assert [speed.human_speed_mps(alpha) for alpha in (0.0, 0.6, 0.8, 1.0)] == [
        1.6,
        0.35,
        0.05,
        0.05,
    ]
    assert speed.human_speed_mps(0.7) == pytest.approx(0.2)
    assert speed.human_speed_mps(float("nan")) == 1.6
    # Up to ``aware_above`` there is no difference.
    plain = InterpolatedHumanSpeed(aware_human_speed_mps=0.35)
    for alpha in np.linspace(0.0, 0.6, 31):
        assert speed.human_speed_mps(alpha) == plain.human_speed_mps(alpha)
    assert plain.human_speed_mps(1.0) == 0.35


def test_by_default_looking_straight_at_the_robot_wins_no_more_than_awareness() -> None:
    speed = AwarenessPolicy().speed
    assert [speed.human_speed_mps(alpha) for alpha in (0.0, 0.6, 0.8, 1.0)] == [1.6, 0.7, 0.7, 0.7]
    # A file with the key ``speed`` replaces the whole default.
    file = {"speed": {"aware_human_speed_mps": 0.5}}
    assert AwarenessPolicy.model_validate(file).speed.human_speed_mps(1.0) == 0.5


def test_the_shapes_in_closed_form() -> None:
    linear = InterpolatedInflation(shape="linear", unaware_below=0.2, aware_above=0.6)
    smooth = linear.model_copy(update={"shape": "smoothstep"})
    assert linear.radius_m(0.3) == pytest.approx(1.0 - 0.25 * 0.55)
    assert smooth.radius_m(0.3) == pytest.approx(1.0 - (3 * 0.25**2 - 2 * 0.25**3) * 0.55)
    assert smooth.radius_m(0.4) == pytest.approx(linear.radius_m(0.4))
    assert linear.radius_m(float("nan")) == 1.0
    logistic = linear.model_copy(update={"shape": "logistic", "steepness": 12.0})
    assert logistic.radius_m(0.4) == pytest.approx(linear.radius_m(0.4))
    # Steeper than a line in the middle, flatter at the ends, and symmetric.
    assert logistic.radius_m(0.25) > linear.radius_m(0.25)
    assert logistic.radius_m(0.45) < linear.radius_m(0.45)
    middle = logistic.radius_m(0.4)
    assert logistic.radius_m(0.3) - middle == pytest.approx(middle - logistic.radius_m(0.5))
    gentle = linear.model_copy(update={"shape": "logistic", "steepness": 1.0})
    assert gentle.radius_m(0.3) == pytest.approx(linear.radius_m(0.3), abs=0.01)


def test_two_levels_have_hysteresis() -> None:
    levels = InterpolatedInflation(shape="two_level", unaware_below=0.2, aware_above=0.6)
    assert [levels.radius_m(alpha) for alpha in (0.0, 0.59, 0.6, 1.0)] == [1.0, 1.0, 0.45, 0.45]
    held, seen = False, []
    for alpha in (0.3, 0.59, 0.6, 0.5, 0.21, 0.2, 0.5, 0.7, float("nan")):
        held = levels.holds(alpha, held)
        seen.append(held)
    assert seen == [False, False, True, True, True, False, False, True, False]
    assert not InterpolatedInflation().holds(1.0, True)


def test_tables_are_interpolated() -> None:
    table = TableInflation(table_m=[[0.2, 1.0], [0.4, 0.6], [0.8, 0.5]])
    given = (0.0, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, float("nan"))
    expected = [1.0, 1.0, 0.8, 0.6, 0.55, 0.5, 0.5, 1.0]
    assert [table.radius_m(alpha) for alpha in given] == pytest.approx(expected)
    speed = TableHumanSpeed(table_mps=[[0.5, 1.6]])
    assert {speed.human_speed_mps(alpha) for alpha in given} == {1.6}


def test_zones_and_caps_in_closed_form() -> None:
    zones = DistanceZones(stop_within_m=0.5, full_speed_beyond_m=2.5)
    distances = [-1.0, 0.5, 1.0, 2.5, 9.0, float("nan")]
    assert zones.limit_mps(distances, 1.2) == pytest.approx([0.0, 0.0, 0.3, 1.2, 1.2, 0.0])
    cap = NearCap(within_m=1.5, speed_mps=0.8)
    assert cap.limit_mps([0.0, 1.5, 2.5, float("nan")], 1.0) == pytest.approx(
        [0.8, 0.8, math.sqrt(0.64 + 2.0), 0.8]
    )


@given(policy=policies())
def test_a_policy_is_the_same_after_yaml(
    policy: AwarenessPolicy, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("policy") / "policy.yaml"
    policy.to_yaml(path)
    assert AwarenessPolicy.from_yaml(path) == policy


def test_presets_are_loaded_by_name() -> None:
    assert AwarenessPolicy.preset("balanced") == AwarenessPolicy()
    blind = AwarenessPolicy.preset("blind")
    for alpha in (0.0, 0.3, 0.7, 1.0):
        assert blind.inflation.radius_m(alpha) == AwarenessPolicy().inflation.radius_m(0.0)
        assert blind.speed.human_speed_mps(alpha) == AwarenessPolicy().speed.human_speed_mps(0.0)
    with pytest.raises(NavError, match=r"'conservative', got 'blinded'; did you mean 'blind'"):
        AwarenessPolicy.preset("blinded")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inflation: {aware_radius: 0.5}", "did you mean 'aware_radius_m'"),
        ("timming: {}", "did you mean 'timing'"),
        ("margins: {minimum_clearance_m: 0.05}", "margins.minimum_clearance_m"),
        ("inflation: {aware_radius_m: 1.2}", "at most unaware_radius_m, got 1.2 m and 1 m"),
        ("speed: {aware_human_speed_mps: 2}", "at most unaware_human_speed_mps, got 2 m/s"),
        ("speed: {watching_above: 0.8}", "belong together, got 0.8 and None"),
        (
            "speed: {watching_above: 0.6, watching_human_speed_mps: 0.1}",
            "watching_above must exceed aware_above, got 0.6 and 0.6",
        ),
        (
            "speed: {watching_above: 0.8, watching_human_speed_mps: 0.8}",
            "at most aware_human_speed_mps, got 0.8 m/s and 0.7 m/s",
        ),
        (
            "speed: {shape: two_level, watching_above: 0.8, watching_human_speed_mps: 0.1}",
            "shape two_level has no watching level",
        ),
        ("speed: {unaware_below: 0.7}", "aware_above must exceed unaware_below"),
        ("inflation: {unaware_radius_m: .nan}", "inflation.unaware_radius_m"),
        ("timing: {stop_after_s: 0.4}", "stale_after_s <= stop_after_s must hold"),
        ("inflation: 3", "inflation"),
        ("inflation: {table: [[0, 1]]}", "did you mean 'table_m'"),
        ("inflation: {table_m: []}", "table_m must hold at least one [awareness, m] pair"),
        ("inflation: {table_m: [[0, 1], [0, 0.5]]}", "awareness must rise, got 0 after 0"),
        ("inflation: {table_m: [[0, 1], [1, 1.5]]}", "must not grow with awareness, got 1.5 m"),
        ("inflation: {table_m: [[0, 1], [1.1, 1]]}", "awareness must lie in [0, 1], got 1.1"),
        ("speed: {table_mps: [[0, -1]]}", "values must lie in [0, 10] m/s, got -1"),
        ("speed: {table_mps: [[0, .nan]]}", "speed.table_mps"),
        ("inflation: {shape: two_levels}", "inflation.shape"),
        ("margins: {maximum_radius_m: 0.39}", "at least the floor of 0.4 m"),
        ("margins: {maximum_radius_m: 0.9}", "at least the unaware radius of 1 m, got 0.9 m"),
        ("rules: {zones: {stop_within_m: 4}}", "full_speed_beyond_m must exceed stop_within_m"),
        ("rules: {near: {}}", "did you mean 'near_cap'"),
        ("outline: {aware_ahead_s: 1}", "at most unaware_ahead_s, got 1 s and 0 s"),
        ("alerts: {horn_within_s: -1}", "alerts.horn_within_s"),
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
