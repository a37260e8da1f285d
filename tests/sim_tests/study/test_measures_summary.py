"""Summaries: what is counted, compared and left out; and the command that prints them."""

import random
from dataclasses import replace

import pytest

from awarenav.cli import main
from sim_tests import SimError
from sim_tests.study.measures import (
    UNCONFIRMED,
    EpisodeRecord,
    Variant,
    labels,
    read_records,
    summarise,
    summary_text,
    write_records,
    zero_of_n_upper,
)
from sim_tests.study.measures._summary import baselines_of

ATTENTION = {"late_glance": "attentive", "reads_a_phone": "unaware"}
LOST_S = {"blind": 6.0, "balanced": 3.0, "oracle": 2.0}


def episode(scenario, seed, policy, **values):
    lost = LOST_S[policy] + 0.1 * seed
    known = {
        "success": True,
        "min_separation_m": 0.5 + 0.01 * seed,
        "time_to_goal_s": 10.0 + lost,
        "time_lost_s": lost,
        "min_margin_m": 0.2,
        "violation_time_s": 0.0,
        "duration_s": 10.0 + lost,
        "attention": ATTENTION[scenario],
        "awareness": "aware" if ATTENTION[scenario] == "attentive" else "unaware",
        "step_out_never": 10.0 * lost,
        "step_out_never_fast": 5.0 * lost,
        "step_out_never_worst_mps": 0.1 * lost,
        "step_out_looking": 100.0,
        "step_out_all": 100.0 + 10.0 * lost,
        "step_out_stress_never": 20.0 * lost,
        "attentive_share": 0.9 if ATTENTION[scenario] == "attentive" else 0.0,
        **values,
    }
    perception = "truth" if policy == "oracle" else "keypoints"
    return EpisodeRecord(scenario, seed, policy, "ReferencePlanner", perception, **known)


RECORDS = [
    episode(scenario, seed, policy)
    for scenario in ATTENTION
    for seed in range(5)
    for policy in LOST_S
]


def only(rows, **values):
    found = [row for row in rows if all(getattr(row, k) == v for k, v in values.items())]
    assert len(found) == 1
    return found[0]


def test_a_row_a_policy_and_one_for_each_part():
    summary = summarise(RECORDS)
    assert [row.variant for row in summary.policies] == ["blind", "balanced", "oracle"]
    row = only(summary.policies, variant="balanced")
    assert (row.episodes, row.errors, row.success.value) == (10, 0, 1.0)
    assert row.robot_contact.high == zero_of_n_upper(10)
    assert row.means["time_lost_s"].value == pytest.approx(3.2)
    assert row.worst["min_separation_m"] == 0.5
    assert row.worst["time_lost_s"] == pytest.approx(3.4)
    assert {row.part for row in summary.scenarios} == set(ATTENTION)
    assert {row.part for row in summary.attentions} == {"attentive", "unaware"}
    assert {row.part for row in summary.awareness} == {"aware", "unaware"}
    assert all(row.episodes == 5 for row in (*summary.scenarios, *summary.awareness))


def test_every_policy_is_compared_with_the_baseline():
    summary = summarise(RECORDS)
    every = only(summary.comparisons, variant="balanced", part="")
    assert (every.baseline, every.pairs) == ("blind", 10)
    assert every.time_lost_s.value == pytest.approx(-3.0)
    assert every.step_out_never.value == pytest.approx(-30.0)
    assert only(summary.comparisons, variant="oracle", part="attentive").pairs == 5
    other = summarise(RECORDS, baseline="balanced")
    assert {each.baseline for each in other.comparisons} == {"balanced"}
    assert summarise(RECORDS, baseline="absent").comparisons == ()


def test_pairs_count_as_attentive_only_where_both_were_measured_so():
    """Seed 1 is not attentive with balanced, seed 2 with nobody, and seed 3 was not measured."""
    shares = {("balanced", 1): 0.7, ("balanced", 2): 0.1, ("blind", 2): 0.2, ("blind", 3): None}
    records = [
        replace(record, attentive_share=shares.get((record.policy, record.seed), 0.9))
        if record.attention == "attentive"
        else record
        for record in RECORDS
    ]
    summary = summarise(records)
    assert only(summary.comparisons, variant="balanced", part="attentive").pairs == 2
    assert only(summary.comparisons, variant="balanced", part=UNCONFIRMED).pairs == 1
    assert only(summary.comparisons, variant="balanced", part="").pairs == 10
    assert only(summary.attentions, variant="blind", part=UNCONFIRMED).episodes == 2
    text = summary_text(summary)
    assert "unconfirmed: the scenario says attentive, but somebody was aware" in text
    assert "unconfirmed" not in summary_text(summarise(RECORDS))


def test_the_order_of_rows_changes_nothing():
    shuffled = list(RECORDS)
    random.Random(1).shuffle(shuffled)
    assert summary_text(summarise(shuffled)) == summary_text(summarise(RECORDS))
    assert summarise(shuffled) == summarise(RECORDS)


def test_errors_are_no_success_and_in_no_mean():
    broken = [replace(r, error="it broke", success=False) if r.seed == 0 else r for r in RECORDS]
    summary = summarise(broken)
    row = only(summary.policies, variant="balanced")
    assert (row.episodes, row.errors) == (10, 2)
    assert row.success.value == pytest.approx(0.8)
    assert row.robot_contact.n == row.means["time_lost_s"].n == 8
    assert only(summary.comparisons, variant="balanced", part="").time_lost_s.left_out == 2
    assert "2 of 10 episodes broke off with an error" in summary_text(summary)


def test_a_contact_with_a_moving_robot_counts_whoever_caused_it():
    """Also in a table of an earlier version, which has the speed at the contact alone."""
    walked_into = {"contact": True, "contact_by": "person", "contacts": 1, "person_contacts": 1}
    changes = {
        0: {"moving_contacts": 1, "moving_contact_mps": 0.4},
        1: {"speed_at_min_separation_mps": 0.4},
        2: {"speed_at_min_separation_mps": 0.01},  # the robot stood
    }
    touched = [
        replace(r, **walked_into, **changes[r.seed])
        if r.policy == "balanced" and r.scenario == "late_glance" and r.seed in changes
        else r
        for r in RECORDS
    ]
    row = only(summarise(touched).policies, variant="balanced")
    shares = (row.moving_contact.value, row.robot_contact.value, row.person_contact.value)
    assert shares == (0.2, 0.0, 0.3)
    assert row.success.value == 1.0
    safety = summary_text(summarise(touched)).partition("Safety")[2]
    line = next(line for line in safety.splitlines() if line.startswith("balanced"))
    assert line.split()[1:4] == ["2", "of", "10"]


def test_variants_are_named_by_what_tells_them_apart():
    variants = [
        Variant("blind", "P", "keypoints"),
        Variant("balanced", "P", "keypoints"),
        Variant("balanced", "P", "keypoints", "late_frames"),
        Variant("oracle", "P", "truth"),
    ]
    assert list(labels(variants).values()) == [
        "blind",
        "balanced, no fault",
        "balanced, late_frames",
        "oracle",
    ]


def test_the_baseline_is_of_the_same_planner_and_the_likest_conditions():
    plain, faulty = Variant("blind", "P", "keypoints"), Variant("blind", "P", "keypoints", "late")
    both = [plain, faulty, Variant("blind", "Q", "keypoints")]
    for fault, expected in (("late", faulty), ("", plain), ("misses", plain)):
        tried = Variant("x", "P", "truth", fault)
        assert baselines_of(tried, [*both, tried], "blind") == (expected,)
    lonely = Variant("x", "R", "keypoints")
    assert baselines_of(lonely, [*both, lonely], "blind") == ()


@pytest.fixture
def run_folder(tmp_path):
    folder = tmp_path / "before"
    folder.mkdir()
    write_records(folder / "episodes.csv", RECORDS)
    return folder


def test_the_command_prints_the_tables(run_folder, capsys):
    assert main(["compare", str(run_folder)]) == 0
    text = capsys.readouterr().out
    assert text.strip() == summary_text(summarise(RECORDS))
    assert "-3.00 [" in text  # 3.2 of 6.2 s
    assert "+6.20 [" in text
    assert max(len(line) for line in text.splitlines()) <= 130


def test_two_runs_are_compared_with_each_other(run_folder, tmp_path, capsys):
    after = tmp_path / "after"
    after.mkdir()
    better = [replace(r, time_lost_s=0.5 * r.time_lost_s) for r in RECORDS]
    write_records(after / "episodes.csv", better)
    out = tmp_path / "all.csv"
    assert main(["compare", str(run_folder), str(after), "--out", str(out)]) == 0
    text = capsys.readouterr().out
    line = next(
        line
        for line in text.splitlines()
        if line.startswith("balanced, after") and "balanced, before" in line
    )
    assert " -1.60 [" in line  # half of 3.2 s
    assert len(read_records(out)) == 2 * len(RECORDS)


def test_an_episode_that_is_there_twice_is_refused():
    with pytest.raises(SimError, match="is there twice"):
        summarise([*RECORDS, RECORDS[0]])
