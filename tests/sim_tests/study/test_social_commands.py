"""``awarenav measures`` and ``awarenav export``: a run measured again, and exported."""

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


def test_an_exported_track_is_measured_as_the_run(run, tmp_path, capsys):
    out = tmp_path / "episode.csv"
    assert main(["export", "episode", str(run), "short:0:balanced", "--out", str(out)]) == 0
    assert "(navwareset, 15 instants, 1 person)" in capsys.readouterr().out
    assert main(["measures", str(out), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out).values()
    measured = next(row for row in rows_of(run / "social.csv") if row["policy"] == "balanced")
    for measure in ("path_length_m", "min_distance_m", "jerk_mps3"):
        name = f"navwareset_{measure}"
        assert found["means"][name] == pytest.approx(float(measured[name]), abs=1e-5)
    assert main(["export", "episode", str(run), "0"]) == 0
    assert (run / "exports" / "episode_00000.json").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["measures", "none.csv"], "cannot read none.csv"),
        (["measures", "RUN", "--out", "x.json"], "--out must be a .csv file, got x.json"),
        (["export", "episode", "RUN", "9"], "the run has 2 episodes, numbered 0 to 1, got 9"),
        (["export", "episode", "RUN", "0", "--format", "socnav"], "did you mean 'socnav3'?"),
        (
            ["export", "episode", "RUN", "0", "--format", "navwareset", "--out", "x.json"],
            "--format navwareset writes files that end in .csv, got x.json",
        ),
    ],
)
def test_bad_input_is_refused(words, message, run, capsys):
    assert main([str(run) if word == "RUN" else word for word in words]) == 2
    assert message in capsys.readouterr().err


def test_the_command_line_knows_every_format():
    assert set(FORMATS) == set(FORMAT_NAMES)
