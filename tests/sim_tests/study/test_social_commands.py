"""``awarenav measures`` and ``awarenav export``: a run measured again, exported and checked."""

from __future__ import annotations

import csv
import json

import pytest
from run_scenes import short_jobs

from awarenav.cli import main
from sim_tests.study.runs import run_jobs
from sim_tests.study.social import FORMATS, SOCIAL_MEASURES
from sim_tests.study.social.command import FORMAT_NAMES


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    run_jobs(short_jobs(1), folder, workers=1)
    return folder


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_run_is_measured_and_agrees_with_its_own_table(run, capsys):
    assert main(["measures", str(run), "--workers", "1"]) == 0
    text = capsys.readouterr().out
    assert "cumulative_heading_changes" in text
    assert "social.csv with 2 episodes" in text
    own, table = rows_of(run / "episodes.csv"), rows_of(run / "social.csv")
    assert [(row["seed"], row["policy"]) for row in table] == [("0", "blind"), ("0", "balanced")]
    for before, after in zip(own, table, strict=True):
        assert set(SOCIAL_MEASURES) < set(after)
        # The same definition in both tables.
        assert after["spl"] == before["spl"]
        assert after["human_delay_s"] == before["human_delay_s"]
        length = pytest.approx(float(before["path_length_m"]), abs=1e-6)
        assert float(after["hunav_path_length_m"]) == length
        assert float(after["navwareset_path_length_m"]) == length
        stl = float(before["time_without_people_s"]) / float(before["time_to_goal_s"])
        assert float(after["stl"]) == pytest.approx(min(stl, 1.0), abs=1e-6)
        # A disc of the robot's corners is never farther from people than the robot itself.
        assert float(after["hunav_min_distance_m"]) <= float(before["min_separation_m"]) + 0.05


def test_an_episode_that_broke_off_has_a_row_with_its_error(tmp_path, capsys, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "gives_up.py").write_text(
        "class GivesUp:\n    def plan(self, *_):\n        raise RuntimeError('no way')\n"
    )
    jobs = short_jobs(1, planners=["gives_up:GivesUp"])[:1]
    run_jobs(jobs, tmp_path / "run", workers=1)
    out = tmp_path / "run" / "social.csv"
    assert main(["measures", str(tmp_path / "run")]) == 1
    assert "episode 0: RuntimeError: no way" in capsys.readouterr().err
    (row,) = rows_of(out)
    assert row["error"] == "RuntimeError: no way"
    assert {row[name] for name in SOCIAL_MEASURES} == {""}
    run_jobs(jobs, tmp_path / "run", workers=1, overwrite=True)
    assert not out.exists()  # its rows are not those of the new run


@pytest.mark.parametrize("name", FORMAT_NAMES)
def test_an_episode_is_exported_checked_and_measured(name, run, tmp_path, capsys):
    if name == "mcap":
        pytest.importorskip("mcap", reason="the extra ros2 is not installed")
    out = tmp_path / f"episode{FORMATS[name].suffix}"
    assert main(["export", "episode", str(run), "short:0:balanced", "--out", str(out)]) == 0
    assert f"({name}, 15 instants, 1 person)" in capsys.readouterr().out
    assert main(["export", "check", str(out)]) == 0
    assert f"{out}: {name}, 15 instants, 1 person. Correct." in capsys.readouterr().out
    assert main(["measures", str(out), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out).values()
    measured = next(row for row in rows_of(run / "social.csv") if row["policy"] == "balanced")
    for measure in (
        "navwareset_path_length_m",
        "navwareset_min_distance_m",
        "navwareset_jerk_mps3",
    ):
        assert found["means"][measure] == pytest.approx(float(measured[measure]), abs=1e-5)
    if name != "navwareset":
        assert found["means"]["hunav_social_work_mps2"] == pytest.approx(
            float(measured["hunav_social_work_mps2"]), abs=1e-5
        )


def test_the_default_file_lies_in_the_run(run, capsys):
    assert main(["export", "episode", str(run), "0"]) == 0
    assert (run / "exports" / "episode_00000.json").is_file()


def test_the_checker_prints_every_broken_field(run, tmp_path, capsys):
    path = tmp_path / "broken.csv"
    path.write_text("timestamp,x,y,column,robot_x,robot_y,robot_yaw_rad\n" + "0,a,b,1,0,0,0\n" * 12)
    assert main(["export", "check", str(path)]) == 1
    text = capsys.readouterr().out
    assert "24 problems" in text
    assert "line 2: x must be a number, got 'a'" in text
    assert "and 4 more" in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["measures", "none.csv"], "cannot read none.csv"),
        (["measures", "table.txt"], "an episode is a file that ends in"),
        (["measures", "RUN", "--out", "x.json"], "--out must be a .csv file, got x.json"),
        (["export", "episode", "RUN", "9"], "the run has 2 episodes, numbered 0 to 1, got 9"),
        (["export", "episode", "RUN", "0", "--format", "socnav"], "did you mean 'socnav3'?"),
        (
            ["export", "episode", "RUN", "0", "--format", "mcap", "--out", "x.json"],
            "--format mcap writes files that end in .mcap, got x.json",
        ),
        (["export", "checks"], "Did you mean 'check'?"),
    ],
)
def test_bad_input_is_refused(words, message, run, capsys):
    assert main([str(run) if word == "RUN" else word for word in words]) == 2
    assert message in capsys.readouterr().err


def test_the_command_line_knows_every_format():
    assert set(FORMATS) == set(FORMAT_NAMES)
