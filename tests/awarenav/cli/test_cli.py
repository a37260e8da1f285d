"""``awarenav crossings`` from the command line to its files; ``demo`` is in ``sim_tests/demo``."""

from __future__ import annotations

import csv

import pytest
from command_line import SHORT_SCENARIO

from awarenav.cli import main
from sim_tests.study.measures import RECORD_COLUMNS


def rows(path):
    with path.open(newline="") as file:
        return list(csv.reader(file))


@pytest.mark.parametrize("command", [[], ["demo"], ["crossings"], ["replay"], ["bench"]])
def test_help_says_what_a_command_does(command, capsys):
    assert main([*command, "--help"]) == 0
    text = capsys.readouterr().out
    assert "Usage: awarenav" in text
    if command and command != ["bench"]:
        assert "--out" in text
    if command in (["demo"], ["crossings"]):
        assert "--seed" in text


def test_crossings_write_one_row_per_episode_with_paired_seeds(tmp_path, capsys):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT_SCENARIO)
    out = tmp_path / "out"
    arguments = ["crossings", "--scenario", str(scenario), "--episodes", "2", "--seed", "7"]
    arguments += ["--workers", "1", "--no-report", "--out", str(out)]
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "contacts" in text
    assert "episodes.csv with 4 episodes" in text
    header, *body = rows(out / "episodes.csv")
    assert tuple(header) == RECORD_COLUMNS
    assert [(row[1], row[2]) for row in body] == [
        ("7", "blind"),
        ("7", "balanced"),
        ("8", "blind"),
        ("8", "balanced"),
    ]
    first = (out / "episodes.csv").read_bytes()
    for again in ("--resume", "--overwrite"):
        assert main([*arguments, again]) == 0
        assert (out / "episodes.csv").read_bytes() == first


def test_crossings_that_fail_are_reported_and_the_others_are_written(tmp_path, capsys):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT_SCENARIO)
    arguments = ["crossings", "--scenario", str(scenario), "--perception", "truth"]
    arguments += ["--planner", "failing_planner:Raises", "reference", "--policy", "blind"]
    arguments += ["--fault", "none", "misses_30", "--workers", "1", "--no-report"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 1
    output = capsys.readouterr()
    assert "2 of 4 episodes failed; episode 0 (short, seed 0): RuntimeError" in output.err
    assert "errors.log has the tracebacks" in output.err
    header, *body = rows(tmp_path / "out" / "episodes.csv")
    assert [row[3] for row in body] == ["Raises", "SamplingPlanner"] * 2
    error = header.index("error")
    assert [bool(row[error]) for row in body] == [True, False] * 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["crossings", "--scenario", "nowhere"], "scenario must be one of"),
        (["crossings", "--policy", "brave"], "preset must be one of"),
        (["crossings", "--policy", "absent.yaml"], "absent.yaml"),
        (["crossings", "--fault", "ghost"], "did you mean 'ghosts'"),
        (["crossings", "--planner", "MyPlanner"], "module:Class"),
        (["bench", "--baseline", "{tmp}"], "baseline"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_2(arguments, message, tmp_path, capsys):
    arguments = [argument.replace("{tmp}", str(tmp_path)) for argument in arguments]
    if arguments[0] == "crossings":
        arguments += ["--out", str(tmp_path / "out")]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()
