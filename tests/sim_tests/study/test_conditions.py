"""The conditions of an episode: every axis reaches every place, and a new one is one field."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import ROOT
from run_scenes import SHORT

from awarenav.cli import app
from sim_tests import run_crossing
from sim_tests.actors.robot import RobotModel
from sim_tests.conditions import AXES, OPTIONS, Conditions, Experiment, Perception
from sim_tests.crossing import Setup
from sim_tests.scenario import Scenario
from sim_tests.study.measures import RECORD_COLUMNS, EpisodeRecord, Variant, labels
from sim_tests.study.runs import Job, about_run, experiment_jobs
from sim_tests.world.errors import SimError

#: Options that a command of crossings does not have.
WITHOUT = {
    "crossings": (),
    "watch": ("scenario",),  # an argument
    "tune": ("fault",),
    "falsify": ("fault",),
    "frontier": ("policy", "fault"),
}


def test_every_axis_has_an_option_a_column_and_a_place_in_job_and_key():
    assert set(AXES) <= set(OPTIONS)
    assert set(AXES) <= set(RECORD_COLUMNS)
    assert issubclass(Job, Conditions)
    key = Conditions(*map(str, range(len(AXES))))
    record = EpisodeRecord(**asdict(key), success=True)
    assert record.conditions == key


@pytest.mark.parametrize("name", WITHOUT)
def test_every_command_has_the_options_of_the_axes(name):
    command = app.get_command(None, name)
    names = {parameter.name for parameter in command.params}
    assert set(OPTIONS) - names == {each for each in WITHOUT[name] if each != "scenario"}


@pytest.mark.parametrize("name", ["crossings", "watch"])
@pytest.mark.parametrize(
    ("perception", "sensors"), [("keypoints", "camera+scanner"), ("truth", "camera")]
)
def test_a_robot_has_all_of_its_sensors_unless_scanners_add_nothing(name, perception, sensors):
    words = ["late_glance"] if name == "watch" else []
    context = app.get_command(None, name).make_context(name, [*words, "--perception", perception])
    experiment = Experiment.taken_from(context.params)
    assert experiment["sensors"] == (sensors,)
    assert experiment.replaced(sensors="scanner")["sensors"] == ("scanner",)


NAMES = st.text("abcdefg_ .'", min_size=1).filter(str.strip)
VALUES = {
    "scenario": st.lists(NAMES, min_size=1, max_size=3).map(tuple),
    "seed": st.integers(0, 99),
    "policy": st.lists(NAMES, min_size=1, max_size=2).map(tuple),
    "planner": st.lists(st.sampled_from(["", "costmap", "a.b:C"]), min_size=1).map(tuple),
    "perception": st.sampled_from(["truth", "keypoints", "pixels"]),
    "sensors": st.sampled_from([("camera",), ("scanner",), ("camera", "camera+scanner")]),
    "camera": st.one_of(st.just(""), NAMES),
    "networks": st.one_of(st.just(""), NAMES),
    "robot": st.one_of(st.just(""), NAMES),
    "population": st.sampled_from(
        [(), ("classic",), ("recorded,answers=0.25",), ("classic", "recorded")]
    ),
    "fault": st.lists(NAMES, min_size=1, max_size=2).map(tuple),
}


@given(values=st.fixed_dictionaries(VALUES), episodes=st.integers(1, 9), sample=st.integers(1, 9))
@settings(deadline=None, derandomize=True)
def test_the_command_of_a_run_gives_the_same_experiment(values, episodes, sample):
    assert set(VALUES) == set(OPTIONS)
    experiment = Experiment(values, episodes)
    for name, more in (("crossings", {"sample": sample}), ("frontier", {})):
        asked = experiment
        if name == "frontier":
            one = {key: each[:1] for key, each in values.items() if isinstance(each, tuple)}
            asked = Experiment({**values, **one, "scenario": values["scenario"]}, episodes)
            for missing in WITHOUT[name]:
                del asked.values[missing]
        text = about_run(asked, name, Path("out"), **more)["command"]
        words = shlex.split(text)
        assert words[:2] == ["awarenav", name]
        context = app.get_command(None, name).make_context(name, words[2:])
        again = Experiment.taken_from(context.params)
        assert again.episodes == episodes
        assert {key: again[key] or None for key in asked.values} == {
            key: asked[key] or None for key in asked.values
        }
        assert context.params.get("sample") == more.get("sample")
        assert context.params["out"] == Path("out")


@pytest.mark.parametrize(
    "name", ["truth", "pixels", "keypoints+scanner", "scanner", "depth+scanner"]
)
def test_the_options_of_a_perception_give_it_in_crossings(name):
    words = Perception.named(name).options.split()
    experiment = Experiment.taken_from(
        app.get_command(None, "crossings").make_context("crossings", words).params
    )
    assert Perception.of(experiment["perception"], experiment.one("sensors")).name == name


def test_the_truth_with_scanners_is_refused_and_the_oracle_is_a_policy():
    for sensors in ("scanner", "camera+scanner"):
        with pytest.raises(SimError, match="no use for other sensors: sensors must be 'camera'"):
            Perception.of("truth", sensors)
    assert Perception(["oracle"]).options == "--policy oracle"


def test_the_api_and_a_job_have_the_same_conditions():
    given = {"policy": "blind", "robot": "omni", "camera": "surround", "population": "recorded"}
    values = {**given, "scenario": "late_glance", "perception": "truth", "seed": 4}
    (job,) = experiment_jobs(Experiment.taken_from({**values, "fault": "misses_30"}))
    setup = Setup.of("late_glance", **given, seed=4, fault="misses_30")
    assert setup.conditions == job.conditions
    assert job.conditions.text == (
        "late_glance_omni, seed 4, policy blind, planner reference, perception truth, "
        "camera surround, robot omni, population recorded, fault misses_30"
    )
    drawn = Scenario.from_text(job.scenario_text).draw(4)
    assert setup.scenario == drawn
    assert setup.scenario.population == "recorded"
    assert setup.scenario.robot_model == RobotModel.shipped("omni")
    assert len(setup.scenario.camera.views_deg) > 1


def test_a_drawn_scenario_is_changed_as_its_template_is():
    scenario = Scenario.shipped("blind_corner")
    changes = {"robot": RobotModel.shipped("forklift"), "population": "answers=0.9"}
    first = Setup.of(scenario.draw(2), policy="blind", seed=2, **changes)
    second = Setup.of(scenario, policy="blind", seed=2, **changes)
    assert first.scenario == second.scenario
    assert first.conditions.robot == "forklift"


def test_tables_tell_episodes_of_other_conditions_apart():
    usual = EpisodeRecord("a", 0, "blind", "P", "truth")
    others = [replace(usual, robot="omni"), replace(usual, population="recorded", robot="omni")]
    variants = [Variant.of(each) for each in (usual, *others)]
    assert list(labels(variants).values()) == [
        *("blind", "blind, robot omni", "blind, robot omni, population recorded")
    ]


def test_an_unknown_axis_is_refused():
    with pytest.raises(TypeError, match="unexpected keyword argument 'weather'"):
        run_crossing("blind_corner", policy="blind", weather="rain")


#: Adds a field to the conditions and its meaning to scenarios; nothing else.
NEW_AXIS = """
import sys
from pathlib import Path
from types import ModuleType

import sim_tests

FIELD = '''
    lasts: str = _axis(
        "Time that the episode lasts.",
        empty=True,
        changes_scenario=True,
        help="Another time that each scenario lasts.",
        default="",
        metavar="S",
    )

    @property
    def conditions(self)'''
path = Path(sim_tests.__file__).with_name("conditions.py")
source = path.read_text().replace("\\n    @property\\n    def conditions(self)", FIELD, 1)
module = ModuleType("sim_tests.conditions")
module.__package__ = "sim_tests"
sys.modules["sim_tests.conditions"] = sim_tests.conditions = module
exec(compile(source, str(path), "exec"), module.__dict__)

from sim_tests.scenario import Scenario

def with_lasts(scenario, text):
    return scenario._with(text, duration_s=float(text))

Scenario.with_lasts = with_lasts

from awarenav.cli import main
from sim_tests import run_crossing
from sim_tests.learning import CrossingEnv

scenario, out = sys.argv[1:]
words = ["crossings", "--scenario", scenario, "--policy", "blind", "--perception", "truth"]
assert main([*words, "--lasts", "0.5", "--workers", "1", "--no-report", "--out", out]) == 0
result = run_crossing(scenario, policy="blind", lasts="0.5")
assert 0.3 < result.duration_s < 0.5, result.duration_s
env = CrossingEnv(scenario, lasts="0.5")
env.reset(seed=0)
assert env.crossing.scenario.duration_s == 0.5
"""


@pytest.mark.slow
def test_a_new_axis_is_one_field_and_its_meaning(tmp_path):
    pytest.importorskip("gymnasium", reason="needs the extra awarenav[gym]")
    scenario, out = tmp_path / "short.yaml", tmp_path / "run"
    scenario.write_text(SHORT.format(name="short"))
    program = tmp_path / "program.py"
    program.write_text(NEW_AXIS)
    words = [sys.executable, str(program), str(scenario), str(out)]
    subprocess.run(words, check=True, cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, timeout=120)
    header, row = (out / "episodes.csv").read_text().splitlines()
    cells = dict(zip(header.split(","), row.split(","), strict=True))
    assert cells["lasts"] == "0.5"
    assert float(cells["duration_s"]) < 0.5
    assert json.loads((out / "jobs.jsonl").read_text())["lasts"] == "0.5"
    about = json.loads((out / "run.json").read_text())
    assert about["settings"]["lasts"] == "0.5"
    assert "--lasts 0.5" in about["command"]


def test_several_populations_are_compared_on_the_same_scenarios_and_seeds():
    asked = ("recorded", "classic", "recorded")
    jobs = experiment_jobs(
        Experiment({"scenario": ("late_glance",), "population": asked, "perception": "truth"}, 2)
    )
    assert [(job.population, job.seed) for job in jobs] == [
        (name, seed) for name in asked[:2] for seed in (0, 1)
    ]
    for job in jobs:
        drawn = Scenario.from_text(job.scenario_text).draw(job.seed)
        assert drawn.population == job.population
