"""``awarenav tune`` and ``awarenav falsify``: runs, resumed runs, refusals and last lines."""

from __future__ import annotations

import csv
import json
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import filelock
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from awarenav.cli import main
from nav_adapter import AwarenessPolicy
from sim_tests import Scenario, SimError
from sim_tests.actors.robot import RobotModel
from sim_tests.conditions import Experiment
from sim_tests.search._settings import command_text, episode_words
from sim_tests.search._study import Outcome, Range, Trial
from sim_tests.search.falsify._results import policy_against, verdict_text
from sim_tests.search.falsify._search import (
    CONTACT_SCORE,
    NO_MARGIN_SCORE,
    Budget,
    Falsification,
    FalsifySettings,
    SearchedEpisode,
    score,
    search,
)
from sim_tests.search.falsify._worst_cases import WorstCase, worst_episodes
from sim_tests.study.measures import EpisodeRecord
from sim_tests.study.runs import policy_text

PRESETS = ("blind", "conservative", "balanced", "assertive")
# A person who crosses ahead and does not look; a robot without its floor hits them.
SCENARIO = """
name: crosses_ahead
description: A person crosses the robot's way and does not look.
duration_s: 3.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
robot: {goal_x_m: 3.0}
people:
  - name: worker
    route: [{x_m: 1.8, y_m: -1.2}, {x_m: 1.8, y_m: {uniform: {low: 1.0, high: 1.4}}}]
    start_s: 0.8
    glances: {notices_within_m: 0.0}
"""
FALSIFY = "falsify --perception truth --worst 1 --episodes 4 --generation 2"
TUNE = "tune --perception truth --trials 2 --generation 2 --episodes 1 --held-out 1 --risk 0.5"
RESULTS = ("*.csv", "*.png", "*.json", "*.yaml", "chosen/*", "episodes.jsonl")


@pytest.fixture
def scenario(tmp_path) -> str:
    path = tmp_path / "mine.yaml"
    path.write_text(SCENARIO)
    return f"--scenario {path}"


def results(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for pattern in RESULTS
        for path in folder.glob(pattern)
    }


def run(*words: object) -> int:
    return main(shlex.split(" ".join(map(str, words))))


def test_a_falsification_finds_a_removed_floor_and_its_worst_case_replays(
    tmp_path, scenario, capsys
):
    out = tmp_path / "out"
    words = (FALSIFY, scenario, "--robot omni --population recorded --unsafe-no-floor --out", out)
    assert run(*words) == 1
    first, printed = results(out), capsys.readouterr()
    assert "UNSAFE" in printed.err
    assert "DOES NOT REPLAY" not in printed.out
    summary = json.loads(first["summary.json"])
    assert summary["contacts"] > 0
    assert [case["replays"] for case in summary["worst"]] == [True]
    assert b"UNSAFE" in first["worst_001.yaml"]
    # The worst case has the robot and the people, and can be run by itself.
    worst = Scenario.from_yaml(out / "worst_001.yaml")
    assert worst.name == "crosses_ahead_omni_worst_001"
    assert worst.robot_model == RobotModel.shipped("omni")
    assert worst.population == "recorded"
    assert worst.people[0].as_written
    # Unasked it is not replaced; resumed, it runs nothing and prints the same.
    assert run(*words) == 2
    message = capsys.readouterr().err
    assert all(remedy in message for remedy in ("--resume", "--overwrite", "--out"))
    assert run(*words, "--resume") == 1
    assert capsys.readouterr().out == printed.out
    with filelock.FileLock(out / ".lock"):
        assert run(*words, "--overwrite") == 2
    assert "another process works in" in capsys.readouterr().err
    for changed, reason in (("--robot forklift", "another scenarios"), ("--seed 1", "seed: 0")):
        assert run(*words, changed, "--resume") == 2
        assert reason in capsys.readouterr().err
    assert results(out) == first
    (out / "mine.txt").write_text("mine")
    # Another seed: nothing of the first search may be used again.
    assert run(*words, "--seed 5 --overwrite") in (0, 1)
    assert (out / "mine.txt").read_text() == "mine"
    assert len((out / "episodes.csv").read_text().splitlines()) == 1 + 4
    assert results(out) != first


def test_a_tuning_writes_policies_above_the_floor_and_goes_on_on_request_only(
    tmp_path, scenario, capsys
):
    out = tmp_path / "out"
    words = (TUNE, scenario, "--out", out)
    assert run(*words) == 0
    first, printed = results(out), capsys.readouterr().out
    for name in (*PRESETS, "scanner", "least_time_lost", "step-out"):
        assert name in printed
    assert "At most 0.50 step-out impacts with people who do not look, per 1 000" in printed
    assert "\nVerdict: keep balanced. " in printed
    assert "\nNext: awarenav tune --policy balanced " in printed
    chosen = json.loads(first["chosen.json"])
    assert chosen["risk"] == {"tuning": 0.5, "held_out": 0.5}
    assert (chosen["tuning_seeds"], chosen["held_out_seeds"]) == ("0 to 0", "1000000 to 1000000")
    for path in (out / "chosen").iterdir():
        assert path.read_text().startswith("# ")
        assert AwarenessPolicy.from_yaml(path).margins.floor_m >= 0.40
    assert run(*words) == 2
    assert "already holds a tuning" in capsys.readouterr().err
    assert run(*words, "--resume") == 0
    assert capsys.readouterr().out == printed
    assert results(out) == first


@pytest.mark.full
@pytest.mark.parametrize(
    ("command", "growing"), [(FALSIFY, "--episodes 6"), (TUNE, "--trials 5 --held-out 2")]
)
def test_a_search_that_grows_with_two_workers_is_that_of_one(tmp_path, scenario, command, growing):
    whole, grown = tmp_path / "whole", tmp_path / "grown"
    status = run(command, scenario, growing, "--out", whole)
    run(command, scenario, "--workers 2 --out", grown)
    assert run(command, scenario, growing, "--workers 2 --resume --out", grown) == status
    assert results(grown) == results(whole)


@pytest.mark.full
def test_the_search_runs_from_keypoints_and_scans(tmp_path):
    """The episodes are those of the perception asked for, and the file replays."""
    out = tmp_path / "out"
    status = run(
        "falsify --policy balanced --scenario crossing_from_left --episodes 2 --generation 2",
        "--perception keypoints --sensors camera+scanner --worst 1 --out",
        out,
    )
    summary = json.loads((out / "summary.json").read_text())
    assert status == (1 if summary["contacts"] else 0)
    assert json.loads((out / "falsify.json").read_text())["perception"] == "keypoints+scanner"
    assert "--perception keypoints --sensors camera+scanner" in (out / "worst_001.yaml").read_text()
    assert [case["replays"] for case in summary["worst"]] == [True]


BLIND = {"inflation": {"unaware_radius_m": 1.2}}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("falsify --episodes 5", "at least one generation of 12 per scenario"),
        ("falsify --policy balancd", "did you mean 'balanced'"),
        ("falsify --against blnd", "did you mean 'blind'"),
        ("falsify --resume", "there is no falsification"),
        ("falsify --planner nowhere", "module:Class"),
        ("falsify --robot forklft", "'forklft' is unknown; did you mean 'forklift'"),
        ("tune --robot forklft", "'forklft' is unknown; did you mean 'forklift'"),
        ("tune --policy balancd", "did you mean 'balanced'"),
        ("tune --policy blind.yaml", "a name of its own, got 'blind'"),
        ("tune --scenario crossing_atentive", "did you mean 'crossing_attentive'"),
        ("tune --ranges nowhere.yaml", "cannot read nowhere.yaml"),
        ("tune --resume", "there is no tuning"),
        ("tune --risk -1", "not in the range"),
        ("tune --requests -1", "not in the range"),
        ("tune --generation 1", "at least 2 trials"),
        ("tune --planner nowhere", "module:Class"),
    ],
)
def test_an_impossible_search_is_refused_with_a_reason_and_leaves_nothing(
    tmp_path, monkeypatch, capsys, words, message
):
    monkeypatch.chdir(tmp_path)
    Path("blind.yaml").write_text(yaml.safe_dump(BLIND))
    if "--scenario" not in words:
        words += " --scenario crossing_from_left"
    assert run(words, "--perception truth --out out") == 2
    assert message in capsys.readouterr().err
    assert not Path("out").exists()


def test_a_table_of_another_command_is_not_overwritten(tmp_path, scenario, capsys):
    (tmp_path / "episodes.csv").write_text("mine\n")
    assert run(FALSIFY, scenario, "--out", tmp_path) == 2
    assert "episodes.csv but no falsify.json" in capsys.readouterr().err
    assert (tmp_path / "episodes.csv").read_text() == "mine\n"


def record(policy="p", **values) -> EpisodeRecord:
    return EpisodeRecord("s", 0, policy, "q", "truth", **values)


def touched(speed_mps):
    """The figures of a contact with a moving robot of a person who had never noticed it."""
    return {
        **dict.fromkeys(("moving_contacts", "moving_contacts_never"), 1),
        **dict.fromkeys(("moving_contact_mps", "moving_contact_never_mps"), speed_mps),
    }


def test_worse_episodes_have_lower_scores():
    aware = {"robot_contacts": 1, "moving_contacts": 1, "moving_contact_mps": 1.4}
    ordered = [
        record(**touched(1.2), min_margin_never_m=0.3),
        record(**touched(0.1), min_margin_never_m=-2.0),
        record(min_margin_never_m=-12.0),
        # Somebody who had looked was touched: the margin counts.
        record(min_margin_never_m=-1.0, **aware),
        record(min_margin_never_m=-0.5, person_contacts=1),
        record(min_margin_never_m=0.5),
        record(),
    ]
    scores = [score(each) for each in ordered]
    assert scores == sorted(set(scores))
    assert scores[1] <= CONTACT_SCORE < scores[2]
    assert score(record(error="died", **touched(1.0))) == NO_MARGIN_SCORE == scores[-1]
    # Whoever looked only because the robot asked is no excuse.
    asked = {**aware, "moving_contacts_asked": 1, "moving_contact_asked_mps": 0.4}
    assert score(record(min_margin_never_m=2.0, **asked)) == CONTACT_SCORE - 0.4
    # Without its floor, a robot must keep clear of everybody.
    assert score(ordered[3], everybody=True) == CONTACT_SCORE - 1.4


@given(episodes=st.integers(1, 5000), scenarios=st.integers(1, 40), generation=st.integers(2, 40))
def test_a_budget_has_at_least_the_given_episodes_in_whole_generations(
    episodes, scenarios, generation
):
    if episodes < generation * scenarios:
        with pytest.raises(SimError, match="at least one generation"):
            Budget.of(episodes, scenarios, generation)
        return
    budget = Budget.of(episodes, scenarios, generation)
    total = budget.total(scenarios)
    assert episodes <= total < episodes + generation * max(budget.worst, 1)
    assert budget.first % generation == budget.total_if_worst % generation == 0
    assert 0 < budget.first <= budget.total_if_worst


PLANTED = {"a": 0.83, "b": 0.12}
PLANTED_SPACE = {name: Range(low=0.0, high=1.0) for name in PLANTED}


def planted_search(total):
    """Search a wide valley about the middle, in which there is a deep one."""

    def evaluate(trials):
        for values in trials.values():
            wide = sum((value - 0.5) ** 2 for value in values.values())
            deep = sum((values[name] - place) ** 2 for name, place in PLANTED.items())
            yield Outcome(min(0.3 + wide, -1.0 + 4.0 * deep), notes={"n": 1})

    middle = dict.fromkeys(PLANTED, 0.5)
    found = search("planted", PLANTED_SPACE, middle, evaluate, seed=1, generation=6)
    return [each for _, whole in zip(range(total // 6), found, strict=False) for each in whole]


def test_a_search_finds_the_deep_valley_and_restarts():
    found = planted_search(72)
    assert len(found) == 72
    assert planted_search(36) == found[:36]
    best = min(found, key=lambda each: each.score)
    assert best.score < -0.99
    for name, place in PLANTED.items():
        assert best.trial.parameters[name] == pytest.approx(place, abs=0.05)
    assert len({each.round for each in found}) > 1
    # The worst cases of one scenario differ.
    worst = worst_episodes(found, {"planted": PLANTED_SPACE}, 5)
    assert [each.score for each in worst] == sorted(each.score for each in worst)
    assert worst[0] == best
    for number, each in enumerate(worst):
        for other in worst[:number]:
            mine, theirs = each.trial.parameters, other.trial.parameters
            assert max(abs(mine[name] - theirs[name]) for name in PLANTED) >= 0.2


SETTINGS = FalsifySettings(
    **{"policy_name": "mine", "policy": policy_text(AwarenessPolicy.preset("assertive"))},
    **{"scenarios": (), "episodes": 4, "perception": "truth", "planner": "", "seed": 0},
    **{"generation": 4, "people": 2},
)


def falsified(*scores: float, notes=({},) * 9) -> Falsification:
    trials = [Trial(row, {}, Outcome(each, {}, notes[row])) for row, each in enumerate(scores)]
    return Falsification(SETTINGS, {}, tuple(SearchedEpisode("s", 0, each) for each in trials))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_search_writes_its_summary(tmp_path, scenario, number):
    out = tmp_path / "out"
    words = f"falsify --perception truth --episodes 4000 --generation 2 {scenario}"
    command = [sys.executable, "-m", "awarenav", *words.split(), "--out", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        until_s = time.monotonic() + 120.0
        while process.poll() is None and time.monotonic() < until_s:
            if sum(path.read_text().count("\n") for path in out.glob("episodes.jsonl")) >= 6:
                break
            time.sleep(0.05)
        process.send_signal(number)
        _, said = process.communicate(timeout=60.0)
    assert process.returncode == 130, said
    summary = json.loads((out / "summary.json").read_text())
    rows = list(csv.DictReader((out / "episodes.csv").read_text().splitlines()))
    assert summary["interrupted"]
    assert len(rows) == summary["episodes"] >= 4
    assert summary["contacts"] == sum(float(row["score"]) <= CONTACT_SCORE for row in rows)
    assert f"in {summary['episodes']} episodes" in said
    assert "--resume" in said


def test_a_contact_that_counts_is_marked_inevitable_or_not():
    notes = [{"moving_contact_stoppable_mps": each} for each in (0.1, 0.3, 0.1)]
    found = falsified(-11.0, -10.5, 0.4, notes=notes)
    assert [each.inevitable for each in found.episodes] == [True, False, False]
    assert (found.contacts, found.inevitable) == (2, 1)
    assert "1 of them are inevitable" in verdict_text(found, [], {})


def cases(*records: EpisodeRecord) -> list[WorstCase]:
    return [
        WorstCase(None, Path(f"worst_{row:03d}.yaml"), None, None, each)
        for row, each in enumerate(records, start=1)
    ]


def test_a_falsified_policy_is_compared_in_the_same_situations():
    mine = [(-1.2, 1), (-0.4, 0), (-0.1, 0)]
    others = {
        f"worst_00{row}.yaml": record("balanced", min_margin_never_m=margin_m)
        for row, margin_m in enumerate((-0.3, -0.5, -0.1), start=1)
    }
    found = cases(*(record(min_margin_never_m=m, moving_contacts=n) for m, n in mine))
    text = verdict_text(falsified(-10.4, -0.4, 0.2), found, others)
    assert text.startswith(
        "mine is not safe enough: the moving robot and a person who had never noticed it, or only "
        "when it asked them to, touched "
        "in 1 of 3 episodes, at up to 0.40 m/s. Nobody who had noticed it was touched by the "
    )
    assert "balanced touches a person while it moves in 0 (mine in 1)" in text
    assert "keeps more margin in 1 and less in 1" in text
    assert "falls to -0.50 m at worst (mine to -1.20 m)" in text
    quiet = verdict_text(falsified(-0.4, 0.2), [], {})
    assert quiet.startswith("no contact of the moving robot and a person who had never noticed")
    failed = {"worst_001.yaml": record("balanced", error="died")}
    assert "balanced" not in verdict_text(falsified(-0.4), found[:1], failed)


def test_contacts_with_people_who_had_noticed_are_told_apart():
    names = [f"moving_contact_{each}_mps" for each in ("never", "past", "looking")]
    rows = [(None, 0.9, None), (None, None, None), (0.7, 1.1, 0.3), (0.2, None, None)]
    notes = [dict(zip(names, row, strict=True)) for row in rows]
    found = falsified(-0.4, -0.3, -10.7, 0.2, notes=notes)
    assert (found.contacts, found.contact_mps) == (1, pytest.approx(0.7))
    assert found.other_speeds_mps == {"past": [0.9, 1.1], "looking": [0.3]}
    text = verdict_text(found, [], {})
    assert "touched in 1 of 4 episodes, at up to 0.70 m/s." in text
    assert "was more than 1 s ago in 2 (50.0 %), at up to 1.10 m/s" in text
    assert "have within 1 s in 1 (25.0 %), at up to 0.30 m/s" in text
    assert "--policy scanner" in text
    # All who were touched had noticed the robot, and the search found no case against it.
    only_aware = verdict_text(replace(found, episodes=found.episodes[:2]), [], {})
    assert only_aware.startswith("no contact of the moving robot and a person")


@pytest.mark.parametrize(
    ("given_name", "policy", "expected"),
    [
        ("", "assertive", "balanced"),
        ("", "balanced", "blind"),
        ("conservative", "balanced", "conservative"),
    ],
)
def test_a_policy_is_compared_with_another_one(given_name, policy, expected):
    settings = replace(SETTINGS, policy=policy_text(AwarenessPolicy.preset(policy)))
    other = policy_against(given_name, settings)
    assert other == (expected, policy_text(AwarenessPolicy.preset(expected)))
    assert policy_against(given_name, replace(settings, unsafe_no_floor=True)) is None


def test_the_next_command_repeats_the_sensors_and_is_safe_for_a_shell():
    values = {"scenario": ("my file.yaml", "runs_out"), "perception": "keypoints", "seed": 3}
    experiment = Experiment.taken_from(
        {**values, "sensors": "camera+scanner", "planner": "a.b:C", "policy": "mine.yaml"}
    )
    words = episode_words(experiment)
    assert shlex.split(command_text("falsify", *words)) == ["awarenav", "falsify", *words]
    assert words[:4] == ["--scenario", "my file.yaml", "--scenario", "runs_out"]
    assert words[4:] == [
        *("--planner", "a.b:C", "--perception", "keypoints", "--sensors", "camera+scanner")
    ]
    others = episode_words(experiment.replaced(population="recorded", robot="my robot.yaml"))
    assert others[-4:] == ["--population", "recorded", "--robot", "my robot.yaml"]
    assert episode_words(Experiment.taken_from({**values, "planner": ""})) == [
        *("--scenario", "my file.yaml", "--scenario", "runs_out"),
        *("--perception", "keypoints", "--sensors", "camera"),
    ]
