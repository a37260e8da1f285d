"""A finished run is replaced on request only: ``tune``, ``falsify``, ``render``."""

from __future__ import annotations

import pytest

from awarenav.cli import main

# A robot that drives 0.6 m past a person who stands.
SCENARIO = """
name: short
description: Two seconds.
duration_s: 2.0
control_hz: 10.0
layout: {x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}
robot: {goal_x_m: 0.6}
workers:
  - path: [{t_s: 0.0, x_m: {uniform: {low: 3.0, high: 4.0}}, y_m: -1.0}]
"""
COMMANDS = {
    "tune": ["--trials", "2", "--generation", "2", "--episodes", "1", "--held-out", "1"],
    "falsify": ["--episodes", "4", "--generation", "4", "--worst", "1"],
    "render": ["--frames", "2", "--scenes", "1", "--size", "64x48", "--processes", "1"],
}
# The rest of a study's files depends on the order in which its processes write.
RESULTS = ("*.csv", "*.png", "*.jsonl", "chosen.json", "summary.json", "worst_*.yaml", "chosen/*")


def words(name, tmp_path):
    out = tmp_path / "out"
    if name == "render":
        return [name, *COMMANDS[name], "--out", str(out)], out
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SCENARIO)
    always = ["--scenario", str(scenario), "--perception", "truth", "--workers", "1"]
    always += ["--out", str(out)]
    return [name, *COMMANDS[name], *always], out


def results(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for pattern in RESULTS
        for path in folder.glob(pattern)
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_a_finished_run_is_not_overwritten_unasked(name, tmp_path, capsys):
    command, out = words(name, tmp_path)
    assert main(command) == 0
    before = results(out)
    assert before
    capsys.readouterr()
    assert main(command) == 2
    message = capsys.readouterr().err
    for remedy in ("--resume", "--overwrite", "--out"):
        assert remedy in message
    assert results(out) == before
    assert main([*command, "--resume"]) == 0
    assert results(out) == before
    (out / "mine.txt").write_text("mine")
    # Another seed: nothing of the first run may be used again.
    assert main([*command, "--seed", "5", "--overwrite"]) == 0
    assert results(out).keys() == before.keys()
    assert results(out) != before
    assert (out / "mine.txt").read_text() == "mine"
    assert main([*command, "--overwrite"]) == 0
    assert results(out) == before


def test_a_table_of_another_command_is_not_overwritten(tmp_path, capsys):
    command, out = words("falsify", tmp_path)
    out.mkdir()
    (out / "episodes.csv").write_text("mine\n")
    assert main(command) == 2
    assert "episodes.csv" in capsys.readouterr().err
    assert (out / "episodes.csv").read_text() == "mine\n"


def test_a_search_that_another_process_runs_is_not_overwritten(tmp_path, capsys):
    from sim_tests.search import ProcessLock  # noqa: PLC0415 - needs the simulator

    command, out = words("falsify", tmp_path)
    assert main(command) == 0
    before = results(out)
    with ProcessLock(out / "locks" / "folder.lock"):
        assert main([*command, "--overwrite"]) == 2
    assert "another process works on the falsification" in capsys.readouterr().err
    assert results(out) == before


def test_an_interrupted_set_of_images_continues_and_there_must_be_one_to_resume(tmp_path, capsys):
    command, out = words("render", tmp_path)
    assert main([*command, "--resume"]) == 2
    assert "there are no images" in capsys.readouterr().err
    assert not out.exists()
    assert main(command) == 0
    before = results(out)
    (out / "000001.png").unlink()
    assert main(command) == 0
    assert results(out) == before
