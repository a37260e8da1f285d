"""The frontier: its policies, what awareness wins, the picture, and the command."""

from __future__ import annotations

import json
import random
from dataclasses import replace

import numpy as np
import pytest

from awarenav.cli import main
from nav_adapter import AwarenessPolicy
from sim_tests.study.frontier._frontier import SPEEDS_MPS, TODAY, Member, family, frontier_of
from sim_tests.study.measures import EpisodeRecord, read_records, write_records

# Mean time lost (s) and impacts of each policy. The line without awareness goes through
# (1, 12), (2, 4) and (4, 0.5); blind_u1 is slower and riskier than the last of them.
LINE = {TODAY: (1.0, 12.0), "blind_u0.6": (2.0, 4.0), "blind_u1.5": (4.0, 0.5)}
ASIDE = {"blind_u1": (5.0, 3.0)}
ATTENTION = {"a": "attentive", "b": "attentive", "c": "mixed", "d": "unaware"}


def rows(policies, *, seeds=6, spread=0.0, free_s=10.0, attentive_s=0.0):
    """Episodes with these means; ``spread`` is a chance part that all policies share."""
    found = []
    for scenario, attention in ATTENTION.items():
        for seed in range(seeds):
            chance = spread * np.random.default_rng([ord(scenario), seed]).uniform(-1.0, 1.0)
            for policy, (lost_s, impacts) in policies.items():
                # Attentive people cost less and others more; the mean is the same.
                shift_s = attentive_s if attention == "attentive" else -attentive_s
                own_s = lost_s + chance - shift_s * lost_s
                found.append(
                    EpisodeRecord(
                        *(scenario, seed, policy, "ReferencePlanner", "truth"),
                        attention=attention,
                        time_without_people_s=free_s,
                        time_to_goal_s=free_s + own_s,
                        time_lost_s=own_s,
                        step_out_all=impacts,
                        step_out_never=0.5 * impacts,
                    )
                )
    return found


def worth_of(name, lost_s, impacts, **values):
    frontier = frontier_of(rows({**LINE, **ASIDE, name: (lost_s, impacts)}, **values))
    return next(each for each in frontier.worth if each.member.name == name)


def test_the_family_differs_in_the_speed_and_in_who_counts_as_aware():
    members = family(memory=True)
    assert len({each.name for each in members}) == len(members)
    assert family(memory=False) == members[: len(family(memory=False))]
    assert {each.speed_mps for each in members if each.kind == "blind"} == set(SPEEDS_MPS)
    radii_m = [each.policy().inflation.radius_m(0.0) for each in members if each.kind == "blind"]
    assert radii_m == sorted(set(radii_m))
    for each in members:
        policy = each.policy()
        assert policy.speed.human_speed_mps(0.0) == each.speed_mps
        aware_mps = each.speed_mps * (1.0 if each.kind == "blind" else 0.23 / 1.5)
        assert policy.speed.human_speed_mps(1.0) == pytest.approx(aware_mps)
        blind_radius = policy.inflation.radius_m(0.0) == policy.inflation.radius_m(1.0)
        assert blind_radius == (each.kind == "blind")
        assert (policy.noticed_counts_as is not None) == (each.kind == "memory")
        assert policy.filter.noticed_memory_s == (3.0 if each.kind == "memory" else 0.0)
    # The default policy is one of them.
    assert Member("memory", 1.5).policy() == AwarenessPolicy.preset("balanced")


def test_awareness_wins_the_distance_to_the_line_at_equal_risk_and_at_equal_time():
    worth = worth_of("aware_u1.5", 2.0, 2.25)
    # At 2.25 impacts the line is halfway between (2, 4) and (4, 0.5).
    assert worth.at_equal_risk_s.value == pytest.approx(1.0)
    assert worth.at_equal_time.value == pytest.approx(4.0 - 2.25)
    # No chance in the rows: the interval is a point.
    assert worth.at_equal_risk_s.low == pytest.approx(1.0)
    assert worth.at_equal_risk_s.high == pytest.approx(1.0)
    # Sibling: between today's AMR and the first policy of the family, and a loss.
    assert worth_of("memory_u0.6", 2.5, 8.0).at_equal_risk_s.value == pytest.approx(-1.0)
    assert worth_of("memory_u0.6", 1.5, 9.0).at_equal_time.value == pytest.approx(-1.0)


def test_an_episode_that_never_arrives_costs_what_it_lasted():
    stuck = [
        replace(each, time_to_goal_s=None, time_lost_s=40.0, duration_s=40.0)
        if each.policy == "blind_u1.5"
        else each
        for each in rows(LINE)
    ]
    point = next(each for each in frontier_of(stuck).points if each.name == "blind_u1.5")
    assert point.time_over_today.value == pytest.approx(40.0 / 11.0)


def test_the_line_is_not_prolonged():
    # Fewer impacts, or faster, than any policy of the line: compared with its end.
    assert worth_of("aware_u1.5", 3.0, 0.0).at_equal_risk_s.value == pytest.approx(1.0)
    assert worth_of("aware_u1.5", 0.5, 3.0).at_equal_time.value == pytest.approx(9.0)
    # More impacts, or slower, than any: no figure rather than one that is too good.
    risky, slow = worth_of("aware_u1.5", 0.5, 13.0), worth_of("aware_u1.5", 4.5, 0.1)
    assert not risky.at_equal_risk_s.known
    assert not risky.attentive_s.known
    assert risky.at_equal_time.known
    assert not slow.at_equal_time.known
    assert slow.at_equal_risk_s.value == pytest.approx(-0.5)


def test_a_policy_without_awareness_that_is_slower_and_riskier_is_not_on_the_line():
    with_it = worth_of("aware_u1.5", 2.0, 2.25)
    alone = frontier_of(rows({**LINE, "aware_u1.5": (2.0, 2.25)})).worth[0]
    assert [each.name for each in frontier_of(rows({**LINE, **ASIDE})).line] == list(LINE)
    assert with_it.at_equal_risk_s.value == pytest.approx(alone.at_equal_risk_s.value)


def test_attentive_people_are_compared_with_the_same_mix_of_policies():
    # With attentive people every policy loses half, so awareness wins half as much.
    worth = worth_of("aware_u1.5", 2.0, 2.25, attentive_s=0.5)
    assert worth.at_equal_risk_s.value == pytest.approx(1.0)
    assert worth.attentive_s.value == pytest.approx(0.5)


def test_chance_that_all_policies_share_does_not_widen_the_intervals_of_what_is_won():
    frontier = frontier_of(rows({**LINE, "aware_u1.5": (2.0, 2.25)}, spread=1.0))
    own, won = frontier.points[-1].time_lost_s, frontier.worth[0].at_equal_risk_s
    assert own.high - own.low > 0.2
    assert won.high - won.low < 1e-6
    assert won.low <= 1.0 + 1e-9
    # Where a policy gains by chance, the interval says so.
    noisy = rows({**LINE, "aware_u1.5": (2.0, 2.25)})
    rng = np.random.default_rng(0)
    noisy = [
        replace(each, time_lost_s=each.time_lost_s + rng.normal())
        if each.policy == "aware_u1.5"
        else each
        for each in noisy
    ]
    won = frontier_of(noisy).worth[0].at_equal_risk_s
    assert won.low < 1.0 < won.high
    assert won.high - won.low > 0.3


def test_points_are_compared_with_today_on_the_same_episodes_in_a_fixed_order():
    records = rows({"blind": (3.0, 1.0), **LINE, "aware_u1.5": (2.0, 2.25)})
    frontier = frontier_of(records)
    names = [TODAY, "blind_u0.6", "blind_u1.5", "aware_u1.5", "blind"]
    assert [each.name for each in frontier.points] == names
    assert frontier.today.time_over_today.value == pytest.approx(1.0)
    assert frontier.points[-1].time_over_today.value == pytest.approx(13.0 / 11.0)
    assert frontier.points[-1].member is None
    assert (frontier.episodes, frontier.scenarios, frontier.free_s) == (24, 4, 10.0)
    random.Random(0).shuffle(records)
    assert frontier_of(records) == frontier
    # An episode that one policy lacks, or that failed, counts for none.
    part = [each for each in records if (each.policy, each.scenario) != ("blind", "a")]
    part = [
        replace(each, error="no") if (each.policy, each.scenario, each.seed) == (TODAY, "b", 0)
        else each
        for each in part
    ]  # fmt: skip
    assert (frontier_of(part).episodes, frontier_of(part).scenarios) == (17, 3)


def test_a_folder_of_episodes_is_drawn_without_running_anything(tmp_path, capsys):
    records = rows({**LINE, "aware_u1.5": (2.0, 2.25)})
    write_records(tmp_path / "episodes.csv", records)
    assert main(["frontier", str(tmp_path)]) == 0
    assert "At equal risk, awareness wins 1.00 s" in capsys.readouterr().out
    data = json.loads((tmp_path / "frontier.json").read_text())
    assert data["worth"][0]["at_equal_risk_s"]["value"] == pytest.approx(1.0)
    assert data["points"][0]["name"] == TODAY
    for name in ("frontier.png", "frontier.svg", "frontier.md"):
        assert (tmp_path / name).stat().st_size > 0
    assert main(["frontier", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == data
    assert main(["frontier", str(tmp_path / "nowhere")]) == 2


_SCENARIO = """
name: {name}
description: A person stands beside the robot's way and looks away.
duration_s: 6.0
control_hz: 10.0
layout: {{x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}}
robot: {{goal_x_m: 2.0}}
people:
  - name: stands
    route: [{{x_m: 2.0, y_m: {y_m}}}]
    glances: {{notices_within_m: 0.0}}
"""


@pytest.mark.slow
@pytest.mark.full
def test_the_family_runs_in_two_scenarios_and_a_resumed_run_only_draws(tmp_path, capsys):
    words = ["frontier", "--perception", "truth", "--workers", "1", "--out", str(tmp_path / "out")]
    for name, y_m in (("near", 1.2), ("far", 1.8)):
        path = tmp_path / f"{name}.yaml"
        path.write_text(_SCENARIO.format(name=name, y_m=y_m))
        words += ["--scenario", str(path)]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "2 episodes of each policy in 2 scenarios" in printed
    records = read_records(tmp_path / "out" / "episodes.csv")
    assert len(records) == 2 * (1 + len(family(memory=False)))
    points = {each.name: each for each in frontier_of(records).points}
    # Whoever assumes faster people loses more time and leaves less to luck.
    slow, fast = points["blind_u0"], points["blind_u1.5"]
    assert slow.time_lost_s.value < fast.time_lost_s.value
    assert slow.impacts.value > fast.impacts.value
    for member in family(memory=False):
        path = tmp_path / "out" / "policies" / f"{member.name}.yaml"
        assert AwarenessPolicy.from_yaml(path) == member.policy()
    assert main(words) == 2  # the folder holds a run
    assert main([*words, "--resume"]) == 0
    assert capsys.readouterr().out == printed
