from __future__ import annotations

import csv
import itertools
import json
import math
import subprocess
import sys
import time

import optuna
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from awarenav.cli import main
from nav_adapter import AwarenessPolicy
from sim_tests import SimError
from sim_tests.crossing import named_policy
from sim_tests.search.tune import (
    Evaluation,
    PolicySpace,
    importances,
    ranked_trials,
    read_ranges,
    shipped_ranges,
)
from sim_tests.study.measures import EpisodeRecord

_PRESETS = ("blind", "conservative", "balanced", "assertive")
_SPACES = {name: PolicySpace(AwarenessPolicy.preset(name)) for name in _PRESETS}
_NAMES = list(shipped_ranges())

shares = st.fixed_dictionaries({name: st.floats(0.0, 1.0) for name in _NAMES})


def _at(space: PolicySpace, share: dict[str, float]) -> dict[str, float]:
    return {n: (1.0 - share[n]) * r.low + share[n] * r.high for n, r in space.ranges.items()}


@given(name=st.sampled_from(_PRESETS), share=shares)
def test_every_point_of_the_space_is_a_policy_that_keeps_the_floor(name, share):
    space = _SPACES[name]
    policy = space.policy(_at(space, share))
    for alpha in (0.0, 0.3, 0.6, 1.0):
        assert policy.inflation.radius_m(alpha) >= 0.40
        assert policy.speed.human_speed_mps(alpha) >= policy.speed.human_speed_mps(1.0)
    assert policy.speed.human_speed_mps(0.0) >= 1.05
    assert policy.margins.clearance_m >= 0.10
    assert AwarenessPolicy.model_validate(policy.model_dump(mode="json")) == policy


@pytest.mark.parametrize("name", _PRESETS)
def test_the_base_policy_is_in_its_space_where_the_ranges_include_it(name):
    base, space = AwarenessPolicy.preset(name), _SPACES[name]
    policy = space.policy(space.base_parameters())
    for path, each in space.ranges.items():
        value = _number(base.model_dump(), path)
        if value is not None and each.low <= value <= each.high:
            assert _number(policy.model_dump(), path) == pytest.approx(value), path


def _number(data: dict, path: str) -> float | None:
    for key in path.split("."):
        data = None if data is None else data.get(key)
    return data


@pytest.mark.parametrize(
    ("base", "part", "searched_with"),
    [
        (AwarenessPolicy.preset("blind"), "attention", "reach"),
        (named_policy("scanner")[1], "reach", "timing"),
        (AwarenessPolicy(attention=None, reach=None), "attention", "filter"),
    ],
)
def test_a_part_that_is_turned_off_is_not_searched_and_stays_off(base, part, searched_with):
    space = PolicySpace(base)
    starts = {name.partition(".")[0] for name in space.ranges}
    assert part not in starts
    assert searched_with in starts
    assert getattr(space.policy(space.base_parameters()), part) is None
    with pytest.raises(SimError, match="turned off every part"):
        PolicySpace(base, {n: r for n, r in shipped_ranges().items() if n.startswith(part)})


def test_the_gain_that_a_request_must_bring_is_searched():
    space = _SPACES["balanced"]
    assert space.base_parameters()["attention.min_gain_s"] == 0.5
    policy = space.policy({**space.base_parameters(), "attention.min_gain_s": 2.0})
    assert policy.attention.min_gain_s == 2.0


def test_one_parameter_may_set_several_keys():
    space = _SPACES["balanced"]
    policy = space.policy({**space.base_parameters(), "speed.aware_above": 0.77})
    assert policy.inflation.aware_above == policy.speed.aware_above == 0.77


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("inflation.aware_radius_m: {low: 0.2, high: 0.8}", "not be searched below 0.4"),
        ("speed.unaware_human_speed_mps: {low: 1.0, high: 1.8}", "not be searched below 1.05"),
        ("margins.clearance_m: {low: 0.05, high: 0.8}", "not be searched below 0.1"),
        (
            "inflation.unaware_radius_m: {low: 0.5, high: 1.0, also: [inflation.aware_radius_m]}\n"
            "inflation.aware_radius: {low: 0.4, high: 0.8}",
            "no number 'inflation.aware_radius'; did you mean 'inflation.aware_radius_m'",
        ),
        ("alerts: {low: 0.4, high: 0.8}", "no number 'alerts'"),
        ("timing.hold_s: {low: 5.0, high: 50.0}", "policy that cannot be"),
    ],
)
def test_ranges_below_the_floor_and_unknown_keys_are_refused(tmp_path, text, message):
    path = tmp_path / "ranges.yaml"
    path.write_text(text)
    with pytest.raises(SimError, match=message):
        PolicySpace(AwarenessPolicy.preset("balanced"), read_ranges(path))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must hold places"),
        ("timing.hold_s: [1, 2", "not valid YAML"),
        ("timing.hold_s: {low: 2.0, high: 1.0}", "high must exceed low"),
        ("timing.hold_s: {low: 2.0, hihg: 3.0}", "did you mean 'high'"),
    ],
)
def test_unusable_files_of_ranges_are_refused_with_a_reason(tmp_path, text, message):
    path = tmp_path / "ranges.yaml"
    path.write_text(text)
    with pytest.raises(SimError, match=message):
        read_ranges(path)


def _trial(number: int, time_s: float, contacts: float = 0.0, over_risk: float = -0.1, **notes):
    trial = optuna.trial.create_trial(
        values=[time_s],
        constraints={"moving_contacts": contacts, "over_risk": over_risk},
        user_attrs={"notes": notes},
    )
    trial.number = number
    return trial


def test_trials_with_a_contact_above_the_risk_or_dropped_have_no_rank():
    trials = [_trial(0, 3.0), _trial(1, 1.0, 1.0), _trial(2, 2.0), _trial(3, 1.0, over_risk=0.1)]
    trials += [_trial(4, 1.0, dropped="loses"), _trial(5, 2.5, over_risk=0.0)]
    assert [trial.number for trial in ranked_trials(trials)] == [2, 5, 0]
    assert ranked_trials(trials[1:2]) == []


def _study(values) -> optuna.Study:
    study = optuna.create_study()
    for x, y in itertools.product(range(6), repeat=2):
        a, b = x / 5.0, y / 5.0
        time_s, risk = values(a, b)
        distribution = optuna.distributions.FloatDistribution(0.0, 1.0)
        study.add_trial(
            optuna.trial.create_trial(
                params={"matters": a, "idle": b},
                distributions={"matters": distribution, "idle": distribution},
                values=[time_s],
                user_attrs={"notes": {"step_out_unaware": risk}},
            )
        )
    return study


def test_importances_are_finite_sum_to_one_and_find_the_parameter_that_matters():
    found = importances(_study(lambda a, b: (a + 0.01 * b, 7.0)))
    first = found["time_lost_s"]
    assert sum(first.values()) == pytest.approx(1.0)
    assert first["matters"] > 0.8
    # No parameter matters for a figure in which no trial differs.
    assert found["step_out_unaware"] == {"matters": 0.0, "idle": 0.0}
    assert all(math.isfinite(v) for each in found.values() for v in each.values())


_WALKED_INTO = {"contact": True, "contact_by": "person", "moving_contacts": 1}


def _record(seed: int, **values) -> EpisodeRecord:
    return EpisodeRecord("s", seed, "p", "q", "truth", **values)


def test_an_evaluation_counts_contacts_and_errors_and_means():
    found = Evaluation.of(
        [
            _record(2, time_lost_s=3.0, step_out_unaware=0.5, person_contacts=1, **_WALKED_INTO),
            _record(0, error="no"),
            _record(1, time_lost_s=1.0, step_out_unaware=0.0, time_to_goal_s=9.0),
        ]
    )
    assert found.figures == (2.0, 0.25)
    assert found.risk == 0.25
    # A person who walked into the moving robot counts, too.
    assert (found.moving_contacts, found.reached, found.errors) == (1, 1, ("no",))
    assert found.minus(found, "time_lost_s").value == 0.0


# A person beside the robot's way, for whom the policies slow down differently.
_SCENARIO = """
name: passing
description: A person stands beside the robot's way and looks away.
duration_s: 5.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
robot: {goal_x_m: 1.5}
workers:
  - path: [{t_s: 0.0, x_m: {uniform: {low: 1.5, high: 2.0}}, y_m: 1.8}]
"""
_TUNE = ["tune", "--trials", "4", "--generation", "3", "--episodes", "1", "--held-out", "1"]
_TUNE += ["--perception", "truth", "--risk", "0.5"]


@pytest.mark.slow
@pytest.mark.full
def test_a_killed_and_resumed_tuning_with_two_workers_writes_the_same_files(tmp_path, capsys):
    scenario = tmp_path / "passing.yaml"
    scenario.write_text(_SCENARIO)
    arguments = [*_TUNE, "--scenario", str(scenario)]
    one, two = tmp_path / "one", tmp_path / "two"
    assert main([*arguments, "--out", str(one)]) == 0
    printed = capsys.readouterr().out
    for name in (*_PRESETS, "scanner", "least_time_lost", "step-out"):
        assert name in printed
    assert "At most 0.50 step-out impacts with unaware people per 1 000 crossings" in printed
    assert "\nVerdict: keep balanced. " in printed
    assert "\nNext: awarenav tune --policy balanced " in printed
    with (one / "trials.csv").open(newline="") as file:
        assert len({row["time_lost_s"] for row in csv.DictReader(file)}) > 1
    command = [sys.executable, "-m", "awarenav", *arguments, "--out", str(two)]
    with subprocess.Popen([*command, "--workers", "2"]) as killed:
        while killed.poll() is None and not (two / "evaluations" / "trial_0001-0-0.csv").exists():
            time.sleep(0.05)
        killed.kill()
    assert killed.returncode == -9
    assert main([*arguments, "--out", str(two), "--resume"]) == 0
    capsys.readouterr()
    for name in ("trials.csv", "chosen.json", "importances.json"):
        assert (one / name).read_bytes() == (two / name).read_bytes()
    assert (one / "tuning.png").read_bytes()[:4] == b"\x89PNG"
    chosen = json.loads((one / "chosen.json").read_text())
    assert chosen["risk"] == {"tuning": 0.5, "held_out": 0.5}
    assert chosen["tuning_seeds"] == "0 to 0"
    assert chosen["held_out_seeds"] == "1000000 to 1000000"
    for path in (one / "chosen").iterdir():
        policy = AwarenessPolicy.from_yaml(path)
        assert path.read_text().startswith("# ")
        assert policy.margins.floor_m >= 0.40
    # A complete tuning that is resumed runs nothing and prints the same.
    assert main([*arguments, "--out", str(one), "--resume"]) == 0
    assert capsys.readouterr().out.endswith(printed)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--policy", "balancd"], "did you mean 'balanced'"),
        (["--scenario", "crossing_atentive"], "did you mean 'crossing_attentive'"),
        (["--ranges", "nowhere.yaml"], "cannot read nowhere.yaml"),
        (["--hold-out-scenarios", "crossing_atentive"], "did you mean 'crossing_attentive'"),
        (["--hold-out-scenarios", "crossing_attentive"], "must leave a scenario to tune on"),
        (["--resume"], "there is no tuning"),
        (["--risk", "-1"], "must be"),
        (["--requests", "-1"], "must be"),
        (["--generation", "1"], "at least 2 trials"),
        (["--planner", "nowhere"], "module:Class"),
    ],
)
def test_an_impossible_tuning_is_refused_with_a_reason_and_leaves_nothing(
    tmp_path, capsys, options, message
):
    out = tmp_path / "out"
    arguments = [*_TUNE, "--scenario", "crossing_attentive", "--out", str(out)]
    assert main([*arguments, *options]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_an_own_policy_needs_a_name_that_no_preset_has(tmp_path, capsys):
    path = tmp_path / "blind.yaml"
    path.write_text(yaml.safe_dump({"inflation": {"unaware_radius_m": 1.2}}))
    arguments = [*_TUNE, "--scenario", "crossing_attentive"]
    assert main([*arguments, "--policy", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "a name of its own, got 'blind'" in capsys.readouterr().err
