"""A comparison of planners: what it runs, what it says, and what becomes of planners that fail."""

from __future__ import annotations

import csv
import json
import re
import shutil

import pytest
from page_reader import PageReader
from scorecard_planners import READY, Straight

from awarenav.cli import main
from sim_tests import SimError
from sim_tests.scenario import ScenarioTemplate
from sim_tests.study.runs import make_planner, policy_of, read_jobs
from sim_tests.study.scorecard import compare_planners, read_scorecard, write_scorecard
from sim_tests.study.scorecard._plan import plan_comparison

SCENE = """
name: beside
description: A person stands beside the way of the robot and looks away.
attention: unaware
duration_s: 9.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -4.0, x_max_m: 8.0, y_max_m: 4.0}
robot: {goal_x_m: 2.0}
workers:
  - path:
      - {t_s: 0.0, x_m: 1.4, y_m: {uniform: {low: 1.75, high: 1.85}}}
"""
OWN = ("Field", "Raises", "ReturnsNothing")


def scene():
    return ScenarioTemplate.from_text(SCENE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A real comparison of the reference planner with four others, on one seed."""
    out = tmp_path_factory.mktemp("planners")
    names = ["straight_on", *(f"scorecard_planners:{name}" for name in OWN)]
    compare_planners(names, [scene()], out, seeds=[1])
    return out


@pytest.fixture(scope="module")
def card(folder):
    return read_scorecard(folder)


def planner(card, name):
    (found,) = (each for each in card.planners if each.name == name)
    return found


def test_every_planner_runs_with_blind_and_the_reference_planner_runs_too(card):
    assert [each.name for each in card.planners] == [
        "reference",
        "straight_on",
        "Field",
        "Field, without the speed field",
        "Raises",
        "ReturnsNothing",
    ]
    for each in card.planners:
        ran = [(score.policy, score.episodes) for score in each.scores]
        assert ran == ([("balanced", 1)] if each.variant_of else [("blind", 1), ("balanced", 1)])
    # Two policies and one probe of radii for five planners, and the variant.
    assert card.episodes == card.planned == 3 * 5 + 1


def test_the_reference_planner_obeys_the_limit_and_uses_radii(card):
    reference = planner(card, "reference")
    for score in reference.scores:
        assert score.goals.value == 1.0
        assert score.limit.obeyed
        assert not score.failed
        assert score.plan_time.ratio == pytest.approx(1.0)
    assert reference.radii.changed.value == 1.0
    assert reference.radii.separation_m.value > 0.1


def test_a_planner_that_reads_nothing_breaks_the_limit_and_ignores_radii(card):
    straight_on = planner(card, "straight_on")
    for score in straight_on.scores:
        assert score.goals.value == 1.0
        assert not score.limit.obeyed
        assert score.limit.excess_mps > 0.3
        assert score.limit.broken.value == 1.0
        assert score.plan_time.ratio < 0.5
    assert straight_on.radii.changed.value == 0.0
    assert straight_on.radii.near == 1
    # It is as fast with every policy.
    assert straight_on.with_policy("balanced").against_blind_s[""].value == 0.0


def test_the_speed_field_is_compared_with_the_same_planner_without_it(card):
    use = planner(card, "Field").field
    assert use.goals_with.value == use.goals_without.value == 1.0
    # It drives 2 m at up to 0.9 instead of 0.3 m/s.
    assert -4.5 < use.time_s.value < -0.3
    assert planner(card, "reference").field is None


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("Raises", "RuntimeError: no way found"),
        ("ReturnsNothing", "SimError: planner ReturnsNothing returned (nan, 0.0) (tuple)"),
    ],
)
def test_a_planner_that_fails_has_a_row_that_says_why(card, folder, name, error):
    found = planner(card, name)
    for score in found.scores:
        assert score.failed == score.episodes == 1
        assert score.goals.value == 0.0
        assert score.plan_time is None
    failure = found.failures[0]
    assert failure.times == 3
    assert failure.message.startswith(error)
    assert read_jobs(folder)[failure.episode].planner == f"scorecard_planners:{name}"
    text = PageReader((folder / "scorecard.html").read_text(encoding="utf-8")).text
    assert f"awarenav replay {folder} {failure.episode}" in text
    assert f"{name} It failed in 3 episodes, 1 of them with balanced" in text


def test_the_page_needs_nothing_else_and_holds_the_verdicts(folder):
    page = PageReader((folder / "scorecard.html").read_text(encoding="utf-8"))
    assert all(each.startswith(("#", "data:")) for each in page.references)
    assert len(page.ids) == len(set(page.ids))
    assert "straight_on It reaches the goal in 1 of 1 episodes with balanced" in page.text
    assert "It does not use the radii: its path is the same with radii 2 times as large" in (
        page.text
    )
    assert "It uses the radii" in page.text
    assert "With the speed field it takes" in page.text


def test_the_tables_hold_the_same_figures(folder, card):
    content = json.loads((folder / "scorecard.json").read_text(encoding="utf-8"))
    assert [each["name"] for each in content["planners"]] == [each.name for each in card.planners]
    with (folder / "scorecard.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    scores = [score for each in card.planners for score in each.scores]
    assert [(line["planner"], line["policy"]) for line in lines] == [
        (score.planner, score.policy) for score in scores
    ]
    assert float(lines[0]["goals"]) == 1.0
    assert float(lines[1]["worst_margin_m"]) == pytest.approx(scores[1].worst_margin_m)
    assert lines[-1]["plan_median_ms"] == ""
    text = (folder / "scorecard.md").read_text(encoding="utf-8")
    assert text.count("| balanced |") == 6
    assert "- **reference**: It reaches the goal" in text


def test_a_comparison_that_was_killed_continues(folder, card, tmp_path):
    out = shutil.copytree(folder, tmp_path / "killed")
    (out / "episodes" / "00015.json").unlink()
    partial = write_scorecard(out)
    assert (partial.episodes, partial.planned) == (15, 16)
    page = PageReader((out / "scorecard.html").read_text(encoding="utf-8"))
    assert "15 of 16 episodes have ended" in page.text
    names = ["straight_on", *(f"scorecard_planners:{name}" for name in OWN)]
    again = compare_planners(names, [scene()], out, seeds=[1], resume=True)
    assert (out / "episodes.csv").read_bytes() == (folder / "episodes.csv").read_bytes()
    kept = [each.scores[0].plan_time for each in again.planners[:2]]
    assert kept == [each.scores[0].plan_time for each in card.planners[:2]]


def test_a_finished_comparison_is_not_run_over(folder):
    names = ["straight_on", *(f"scorecard_planners:{name}" for name in OWN)]
    with pytest.raises(SimError, match="holds a finished run"):
        compare_planners(names, [scene()], folder, seeds=[1])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["scorecard_planners"], "module:Class, e.g. .* or as one of reference, costmap"),
        (["scorecard_planners:Absent"], "has no attribute 'Absent'"),
        (
            ["scorecard_planners:Straight(gain=2)"],
            "no argument 'gain'; it has 'robot', 'speed_mps'",
        ),
        (["scorecard_planners:Straight(2.0)"], r"module:Class\(name=value, …\)"),
        (["scorecard_planners:Straight(speed_mps=[1])"], "with numbers, strings"),
        (["straight_on", "--seeds", "4-2"], "the first and the last as 10-19, got '4-2'"),
        (["straight_on", "--seeds", "0"], "at least 1"),
        (["straight_on", "--scenario", "paper_encounter"], "drives straight on without a planner"),
    ],
)
def test_bad_input_is_refused_before_anything_runs(words, message, tmp_path, capsys):
    assert main(["planners", "compare", *words, "--out", str(tmp_path / "out")]) == 2
    assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "out").exists()


def test_a_planner_may_be_an_object_or_have_arguments():
    scenario = scene().median()
    made = make_planner("scorecard_planners:READY", scenario)
    assert made is not READY
    assert made.speed_mps == 0.5
    assert make_planner("scorecard_planners:Straight(speed_mps=0.3)", scenario).speed_mps == 0.3
    assert make_planner("straight_on", scenario).plan


def test_a_planner_without_the_field_by_default_is_compared_with_it():
    plan, jobs = plan_comparison(
        ["scorecard_planners:NoField", "scorecard_planners:Field(use_speed_field=False)"],
        [scene()],
        ["balanced"],
        [3, 4],
        perception="truth",
    )
    found = {
        each.name: (each.planner.partition(":")[2], each.speed_field) for each in plan.entrants
    }
    assert found == {
        "reference": ("", None),
        "NoField": ("NoField", False),
        "NoField, with the speed field": ("NoField(use_speed_field=True)", True),
        "Field(use_speed_field=False)": ("Field(use_speed_field=False)", False),
    }
    # Three planners with two policies and the probe, and the variant with one policy.
    assert len(jobs) == 2 * (3 * 3 + 1)


def test_classes_are_planners_too_and_others_are_refused(tmp_path):
    with pytest.raises(SimError, match="got <function"):
        compare_planners([lambda robot: None], [scene()], tmp_path)
    with pytest.raises(SimError, match="seeds must be at least one"):
        compare_planners([Straight], [scene()], tmp_path, seeds=())
    with pytest.raises(SimError, match="scenarios must be at least one"):
        compare_planners([Straight], [], tmp_path)


def test_the_probe_of_radii_changes_radii_alone(folder):
    jobs = read_jobs(folder)
    wide = next(job for job in jobs if job.policy_name == "balanced, radii × 2")
    usual = next(job for job in jobs if job.policy_name == "balanced")
    changed, same = policy_of(wide.policy), policy_of(usual.policy)
    assert changed.inflation.radius_m(0.0) == 2.0 * same.inflation.radius_m(0.0)
    assert changed.inflation.radius_m(1.0) == 2.0 * same.inflation.radius_m(1.0)
    assert changed.model_copy(update={"inflation": same.inflation}) == same


@pytest.mark.full
def test_a_planner_that_hangs_costs_its_own_episodes_alone(tmp_path, capfd):
    (tmp_path / "beside.yaml").write_text(SCENE, encoding="utf-8")
    words = ["scorecard_planners:Hangs", "--scenario", str(tmp_path / "beside.yaml")]
    words += ["--seeds", "1-1", "--workers", "1", "--time-limit", "30", "--json"]
    assert main(["planners", "compare", *words, "--out", str(tmp_path / "out")]) == 1
    printed = capfd.readouterr()
    reference, hangs = json.loads(printed.out)["planners"]
    assert reference["scores"][0]["goals"]["value"] == 1.0
    (failure,) = hangs["failures"]
    assert failure["times"] == 3
    assert "time limit" in failure["message"]
    assert "3 of 6 episodes failed" in printed.err
