"""A comparison of planners: what it runs, what it says, and what becomes of planners that fail."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from page_reader import PageReader

from awarenav.cli import main
from sim_tests.conditions import Experiment
from sim_tests.scenario import Scenario
from sim_tests.study.measures import Conduct
from sim_tests.study.report import compare_planners
from sim_tests.study.report._compare import plan_comparison
from sim_tests.study.report._results import Results, Run
from sim_tests.study.report._write import planners_section
from sim_tests.study.report.command import command_line
from sim_tests.study.runs import policy_of, read_attempts, read_jobs, scenario_of

SCENE = """
name: beside
description: A person stands beside the way of the robot and looks away.
attention: unaware
duration_s: 9.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -4.0, x_max_m: 8.0, y_max_m: 4.0}
robot: {goal_x_m: 2.0}
people:
  - name: stands
    route: [{x_m: 1.4, y_m: {uniform: {low: 1.75, high: 1.85}}}]
    glances: {notices_within_m: 0.0}
"""
NAMES = ["straight_on", "costmap", "run_planners:Raises", "run_planners:ReturnsNothing"]


def scene():
    return Scenario.from_text(SCENE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A real comparison of the reference planner with four others, on one seed."""
    out = tmp_path_factory.mktemp("planners")
    records = compare_planners(NAMES, [scene()], out, seeds=[1])
    # Two policies and one probe of radii for five planners.
    assert len(records) == 3 * 5
    return out


@pytest.fixture(scope="module")
def page(folder):
    return PageReader((folder / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def tables(folder):
    """The tables of conduct and of radii, by the name in their first column."""
    run = Run.read(folder)
    section = planners_section(Results.of(run), run)
    return [{next(iter(row.values())): row for row in each.values()} for each in section.tables]


def test_every_planner_runs_with_blind_and_the_reference_planner_runs_too(folder):
    ran = [(key.policy, key.planner) for key in read_jobs(folder)]
    for policy in ("blind", "balanced", "balanced, radii × 2"):
        planners = [planner for of, planner in ran if of == policy]
        others = ["straight_on", "costmap", "Raises", "ReturnsNothing"]
        assert planners == ["ReferencePlanner", *others]


def test_obeying_and_using_radii_are_told_from_reading_nothing(tables, page):
    conduct, radii = tables
    reference, straight_on = (conduct[f"balanced, {n}"] for n in ("reference", "straight_on"))
    assert reference["Speed limit, m/s"] <= 0.03
    assert reference["Episodes over"] == 0.0
    assert reference["× reference"] == pytest.approx(1.0)
    assert straight_on["Speed limit, m/s"] > 0.3
    assert straight_on["Episodes over"] == 1.0
    assert straight_on["× reference"] < 0.5
    assert radii["costmap"]["Radii"] == "uses them"
    assert radii["costmap"]["More distance, m"] > 0.1
    assert radii["straight_on"]["Radii"] == "ignores them"
    assert radii["straight_on"]["Somebody near"] == 1.0
    assert radii["Raises"]["Radii"] == "–"
    assert "It exceeds the speed limit in 1 of 1 episode, by up to" in page.text
    assert "It obeys the speed limit." in page.text


def test_planners_that_fail_have_rows_that_say_why(folder, page):
    failed = {n: each for n, each in read_attempts(folder).items() if each.record.error}
    assert len(failed) == 2 * 3
    for name, error in (
        ("Raises", "RuntimeError: no way found"),
        ("ReturnsNothing", "SimError: planner ReturnsNothing returned (nan, 0.0) (tuple)"),
    ):
        own = [n for n, each in failed.items() if each.record.planner == name]
        assert len(own) == 3
        assert error in page.text
        assert f"awarenav replay {folder} {own[0]}" in page.text
    assert "6 episodes failed" in page.text
    assert "0 of 1 (≤ 95.0\u202f%)" in page.text  # successes


def conduct_cells(run, **changed):
    """The cells of the table of conduct, with other conduct of ``straight_on``."""
    episodes = tuple(
        replace(each, conduct=Conduct(**{**GOOD, **changed}))
        if each.record.planner == "straight_on"
        else each
        for each in run.episodes
    )
    changed_run = replace(run, episodes=episodes)
    (conduct, *_) = planners_section(Results.of(changed_run), changed_run).tables
    row = next(row for row in conduct.cells if row[0].text == "balanced, straight_on")
    return dict(zip(conduct.columns, row, strict=True))


GOOD = {
    "limit_excess_mps": 0.0,
    "fastest_point_excess_mps": -0.1,
    "plan_calls": 200,
    "plan_median_s": 0.002,
    "plan_p99_s": 0.004,
    "cycle_s": 0.05,
}


@pytest.mark.parametrize(
    ("changed", "column", "text", "bad"),
    [
        ({}, "Speed limit, m/s", "obeyed", False),
        ({"limit_excess_mps": 0.03}, "Speed limit, m/s", "obeyed", False),
        ({"limit_excess_mps": 0.4}, "Speed limit, m/s", "+0.40", True),
        ({"fastest_point_excess_mps": 0.05}, "Yaw rule, m/s", "+0.05", True),
        ({"fastest_point_excess_mps": None}, "Yaw rule, m/s", "–", False),
        ({"plan_p99_s": 0.08}, "99th percentile, ms", "80.00", True),
        ({"plan_p99_s": 0.04}, "99th percentile, ms", "40.00", False),
    ],
)
def test_a_broken_limit_and_a_late_command_are_marked(folder, changed, column, text, bad):
    cell = conduct_cells(Run.read(folder), **changed)[column]
    assert (cell.text, cell.bad) == (text, bad)


def test_the_probe_of_radii_changes_radii_alone():
    jobs, wide = plan_comparison(["straight_on"], [scene()], ["oracle", "balanced"], range(7))
    assert wide == "balanced, radii × 2"
    assert sum(job.policy == wide for job in jobs) == 2 * 5
    policies = {job.policy: policy_of(job.policy_text) for job in jobs}
    changed, same = policies[wide], policies["balanced"]
    assert changed.inflation.radius_m(0.0) == 2.0 * same.inflation.radius_m(0.0)
    assert changed.inflation.radius_m(1.0) == 2.0 * same.inflation.radius_m(1.0)
    assert changed.model_copy(update={"inflation": same.inflation}) == same


def test_robot_and_population_are_those_of_every_episode_and_of_the_command():
    jobs, _ = plan_comparison(
        ["straight_on"],
        ["late_glance", Scenario.shipped("crossing_attentive")],
        ["balanced"],
        (0,),
        robot="delivery",
        population="recorded",
    )
    names = {job.scenario for job in jobs}
    assert names == {"late_glance_delivery", "crossing_attentive_delivery"}
    assert {scenario_of(job.scenario_text).draw(0).population for job in jobs} == {"recorded"}
    values = {"scenario": ("runs_out",), "policy": ("blind",), "perception": "truth"}
    values |= {"sensors": "camera+scanner", "camera": "", "robot": "omni", "population": "recorded"}
    experiment = Experiment.taken_from(values)
    assert command_line(("reference",), (0, 1), experiment, Path("out")) == (
        "awarenav planners compare reference --scenario runs_out --policy blind --seeds 0-1 "
        "--perception truth --sensors camera+scanner --robot omni --population recorded --out out"
    )


@pytest.mark.full
def test_a_planner_that_hangs_costs_its_own_episodes_alone(tmp_path, capfd):
    (tmp_path / "beside.yaml").write_text(SCENE, encoding="utf-8")
    words = ["run_planners:Hangs", "--scenario", str(tmp_path / "beside.yaml")]
    words += ["--seeds", "1-1", "--workers", "1", "--time-limit", "30", "--json"]
    assert main(["planners", "compare", *words, "--out", str(tmp_path / "out")]) == 1
    printed = capfd.readouterr()
    arms = {each["variant"]: each for each in json.loads(printed.out)["arms"]}
    assert arms["balanced, reference"]["success"]["value"] == 1.0
    assert arms["balanced, Hangs"]["errors"] == 1
    assert "3 of 6 episodes failed" in printed.err
