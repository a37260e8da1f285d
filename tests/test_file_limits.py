"""Every YAML and JSON file is read with limits on size, nesting and aliases."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from paths import ROOT

from awarenav.baseline import read_baseline
from awarenav.errors import AwarenavError
from awarenav.estimate import open_source
from awarenav.records import continue_records, read_records
from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.ros2 import RobotFile
from perception import Camera, PerceptionError
from perception._manifest import shipped_models
from perception.documents import (
    MAX_DEPTH,
    MAX_JSON_BYTES,
    MAX_LINE_BYTES,
    MAX_YAML_BYTES,
    parse_json,
    parse_yaml,
)
from perception.named import Catalogue
from perception.surround import FisheyeLens
from sim_tests import SimError
from sim_tests.crossing.faults import Fault
from sim_tests.dataset import RenderConfig
from sim_tests.scenario import Scenario
from sim_tests.scenario._files import camera_data
from sim_tests.search._settings import write_or_check_settings
from sim_tests.search.falsify._search import FalsifySettings
from sim_tests.search.tune._policy_space import read_ranges
from sim_tests.study.runs import fault_of, policy_of, read_jobs, read_run, scenario_of
from tracking import TrackerConfig, TrackingError

BRACKETS = "[" * 100_000
ALIASES = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{after}: &{after} [{','.join([f'*{name}'] * 9)}]\n"
    for name, after in zip("abcdefgh", "bcdefghi", strict=True)
)
HOSTILE = {
    "aliases": (parse_yaml, ALIASES, "more than 200000 values"),
    "brackets": (parse_yaml, BRACKETS, "nested too deeply"),
    "an alias in itself": (parse_yaml, "a: &a [*a]", "within the value that it stands for"),
    "merged aliases": (
        parse_yaml,
        re.sub(r"\[(\*.*)\]", r"{<<: [\1]}", ALIASES),
        "more than 200000 values",
    ),
    "to the base 60": (parse_yaml, "a: " + "1:" * 100_000 + "1", "a number of 200001 characters"),
    "a long number": (parse_yaml, "a: " + "9" * 5000, "a number of 5000 characters"),
    "a date that is none": (parse_yaml, "a: 2001-99-99", "not valid YAML"),
    "a program": (parse_yaml, "!!python/object/apply:os.system ['true']", "not valid YAML"),
    "a huge file": (parse_yaml, "# " + "x" * MAX_YAML_BYTES, "too large: at most 1 MiB"),
    "braces in JSON": (parse_json, '{"a":' * 100_000, "nested too deeply"),
    "a long number in JSON": (parse_json, "9" * 5000, "not valid JSON"),
}
SETTINGS = FalsifySettings(
    **{"policy_name": "p", "policy": "{}", "scenarios": ("name: a",), "episodes": 4, "people": 1},
    **{"perception": "truth", "planner": "", "seed": 0, "generation": 4},
)


def search_settings(path):
    write_or_check_settings(SETTINGS, path, "falsification", resume=True)


YAML_READERS = {
    "Camera": (Camera.from_yaml, PerceptionError),
    "FisheyeLens": (FisheyeLens.from_yaml, PerceptionError),
    "TrackerConfig": (TrackerConfig.from_yaml, TrackingError),
    "AwarenessPolicy": (AwarenessPolicy.from_yaml, NavError),
    "RobotFile": (RobotFile.from_yaml, ValueError),
    "Catalogue": (Catalogue.from_yaml, AwarenavError),
    "Scenario": (Scenario.from_yaml, SimError),
    "camera of a scenario": (lambda path: camera_data(str(path)), SimError),
    "Fault": (lambda path: Fault.of(str(path)), SimError),
    "ranges of a tuning": (read_ranges, SimError),
    "RenderConfig": (RenderConfig.from_yaml, SimError),
    "a recording": (lambda path: open_source(str(path.parent)), AwarenavError),
}
JSON_READERS = {
    "shipped_models": ("manifest.json", lambda path: shipped_models(path.parent), PerceptionError),
    "baseline": ("baseline.json", read_baseline, AwarenavError),
    "frames": ("truth.jsonl", read_records, AwarenavError),
    "continued frames": ("truth.jsonl", continue_records, AwarenavError),
    "jobs": ("jobs.jsonl", lambda path: read_jobs(path.parent), SimError),
    "settings of a search": ("falsify.json", search_settings, SimError),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_text_is_refused(kind):
    parse, text, message = HOSTILE[kind]
    with pytest.raises(PerceptionError, match=message):
        parse(text, "text")


@pytest.mark.parametrize("name", YAML_READERS)
def test_every_reader_refuses_hostile_yaml(name, tmp_path):
    read, error = YAML_READERS[name]
    if name == "a recording":
        pytest.importorskip("rosbags")
    path = tmp_path / ("metadata.yaml" if name == "a recording" else "file.yaml")
    path.write_text(ALIASES)
    with pytest.raises(error, match="more than 200000 values") as caught:
        read(path)
    assert path.name in str(caught.value)


@pytest.mark.parametrize("name", JSON_READERS)
def test_every_reader_refuses_hostile_and_huge_json(name, tmp_path):
    file, read, error = JSON_READERS[name]
    path = tmp_path / file
    path.write_text(BRACKETS + "\n")
    with pytest.raises(error, match="nested too deeply") as caught:
        read(path)
    assert path.name in str(caught.value)

    with path.open("wb") as hole:  # takes no space on the disk
        hole.truncate((MAX_LINE_BYTES if path.suffix == ".jsonl" else MAX_JSON_BYTES) + 1)
    with pytest.raises(error, match=r"too large: at most (16|64) MiB"):
        read(path)


@pytest.mark.parametrize("read", [policy_of, fault_of, scenario_of])
def test_hostile_texts_of_a_job_are_refused(read):
    with pytest.raises(SimError, match="more than 200000 values"):
        read(ALIASES)


def test_a_hostile_run_json_counts_as_none(tmp_path):
    (tmp_path / "run.json").write_text(BRACKETS)
    assert read_run(tmp_path) == {}


def test_ordinary_documents_are_read_as_before():
    text = "a: &x {k: [1, 2.5, 1:30]}\nb: {<<: *x, l: ~}\nc: [*x, *x]\nd: '" + "9" * 99 + "'\n"
    x = {"k": [1, 2.5, 90]}
    assert parse_yaml(text, "text") == {"a": x, "b": {**x, "l": None}, "c": [x, x], "d": "9" * 99}
    deep = "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert parse_yaml(deep, "text") == parse_json(deep, "text")
    assert parse_yaml("", "text") is None
    assert parse_yaml("a: 1\n---\n" + BRACKETS[:60], "t", first_document=True) == {"a": 1}
    with pytest.raises(PerceptionError, match="single document"):
        parse_yaml("a: 1\n---\nb: 2\n", "text")


def test_no_other_module_parses_yaml_or_json():
    """Messages between processes of this program are no files.

    The record of an installer is read by the guard against a clash, which may import nothing.
    """
    own = {
        "sim_tests/study/runs/_episode.py",
        "sim_tests/crossing/planner/ros2/_actions.py",
        "sim_tests/crossing/planner/ros2/_client.py",
        "perception/installation.py",
    }
    pattern = re.compile(r"yaml\.(\w*load\w*)\(|json\.loads?\(|model_validate_json\(|YAML\(")
    packages = ("perception", "tracking", "nav_adapter", "awarenav", "sim_tests", "training")
    found = {
        path.relative_to(ROOT).as_posix()
        for package in packages
        for path in Path(ROOT, package).rglob("*.py")
        if pattern.search(path.read_text(encoding="utf-8"))
    }
    assert found == {"perception/documents.py", *own}
