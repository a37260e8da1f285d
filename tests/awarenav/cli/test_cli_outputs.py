"""Outputs of commands: JSON, letters that an output lacks, file names, completions."""

from __future__ import annotations

import csv
import io
import json
import os
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete
from command_line import SHORT_SCENARIO, run_python
from paths import ROOT

from awarenav.cli import app, main

TABLE = "t_s,id,x_m,y_m\n" + "".join(f"{0.1 * k:.1f},bén,{0.1 * k:.2f},0\n" for k in range(12))
POLICY = ROOT / "nav_adapter/policies/balanced.yaml"
ROBOT = ROOT / "docs/nav2/robot.yaml"
SCENARIO = ROOT / "sim_tests/scenario/shipped/late_glance.yaml"


def json_of(capfd, *words):
    """Run a command and return the JSON that it prints, and nothing else."""
    assert main([*map(str, words), "--json"]) == 0
    return json.loads(capfd.readouterr().out)


def test_tools_print_json(capfd, tmp_path):
    shown = json_of(capfd, "policy", "show", "blind", "balanced", "--out", "none")
    assert list(shown) == ["blind", "balanced"]
    assert len(shown["blind"]["radius_m"]) == len(shown["blind"]["awareness"])
    listed = json_of(capfd, "models", "list", "--out", tmp_path)
    assert {"shipped", "real_robot", "named_only"} < set(listed)
    states = json_of(capfd, "models", "verify", "--out", tmp_path)
    assert set(states) == {each["name"] for each in listed["shipped"]}
    subjects = [each["subject"] for each in json_of(capfd, "doctor")]
    assert {"packages", "shipped networks", "extras"} <= set(subjects)


def test_crossings_print_json_and_name_episodes_that_fail(capfd, tmp_path):
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SHORT_SCENARIO)
    arguments = ["crossings", "--scenario", str(scenario), "--perception", "truth", "--seed", "7"]
    arguments += ["--planner", "failing_planner:Raises", "reference", "--policy", "blind"]
    arguments += ["--episodes", "2", "--workers", "1", "--no-report", "--json"]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 1
    output = capfd.readouterr()
    assert "2 of 4 episodes failed; episode 0 (short, seed 7): RuntimeError" in output.err
    assert json.loads(output.out)
    with (tmp_path / "out" / "episodes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["seed"], row["planner"], bool(row["error"])) for row in rows] == [
        (seed, planner, planner == "Raises")
        for seed in ("7", "8")
        for planner in ("Raises", "ReferencePlanner")
    ]


def printed(words: list[str], encoding: str, monkeypatch, status: int = 0) -> str:
    """Return what a command prints to outputs of this encoding."""
    streams = {name: io.TextIOWrapper(io.BytesIO(), encoding) for name in ("stdout", "stderr")}
    for name, stream in streams.items():
        monkeypatch.setattr(sys, name, stream)
    assert main(words) == status
    for stream in streams.values():
        stream.flush()
    monkeypatch.undo()
    return "".join(stream.buffer.getvalue().decode(encoding) for stream in streams.values())


@pytest.mark.parametrize("encoding", ["ascii", "cp437", "utf-8"])
def test_every_output_takes_every_letter(encoding: str, tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "people – α.csv"
    path.write_text(TABLE, encoding="utf-8")
    words = ["tracks", str(path), "--out", "none", "--csv", str(tmp_path / "α.csv")]
    text = printed(words, encoding, monkeypatch)
    assert (r"mean \u03b1" if encoding == "ascii" else "mean α") in text
    assert (r"b\u00e9n" if encoding == "ascii" else "bén") in text
    assert (tmp_path / "α.csv").exists()
    gone = printed(["tracks", "→.csv", "--out", "none"], encoding, monkeypatch, status=2)
    assert "cannot read" in gone


def test_a_file_name_that_is_not_utf_8_is_only_a_name(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"l\xe4ute")
    try:
        folder.mkdir()
    except OSError:  # such as on macOS
        pytest.skip("this file system has no such names")
    path = folder / os.fsdecode(b"l\xe4ute.csv")
    path.write_text(TABLE, encoding="utf-8")
    words = ["--out", str(folder / "plot.svg"), "--csv", str(folder / os.fsdecode(b"\xe4.csv"))]
    assert main(["tracks", str(path), *words]) == 0
    assert (folder / "plot.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "file", "kind"),
    [
        (["scenario", "validate"], POLICY, ": this is a policy, not a scenario"),
        (["policy", "show"], SCENARIO, ": this is a scenario; unknown key 'name' in Aw"),
        (["policy", "show"], ROBOT, ": this is the file of a robot; unknown key 'footprint_m'"),
        (["tracks", "x.csv", "--config"], POLICY, ": this is a policy; TrackerConfig: unknown key"),
    ],
)
def test_a_file_of_another_kind_is_named(words, file: Path, kind: str, tmp_path, capsys) -> None:
    own = tmp_path / "mine.yaml"
    own.write_bytes(file.read_bytes())
    assert main([*words, str(own)]) == 2
    out, err = capsys.readouterr()
    assert f"{own}{kind}" in out + err
    assert "did you mean" not in out + err


def offered(*words):
    """Return the completions of the last word, as the shell gets them."""
    *before, incomplete = words
    return ShellComplete(app, {}, "awarenav", "_AWARENAV_COMPLETE").get_completions(
        before, incomplete
    )


def values(*words):
    return [item.value for item in offered(*words)]


def test_commands_are_completed_with_their_help_and_without_importing_them():
    items = {item.value: item.help for item in offered("")}
    assert items["judge"] == "Compare estimates with the truth."
    assert "report" in values("re")
    code = (
        "import sys; from click.shell_completion import ShellComplete; "
        "from awarenav.cli import app; "
        "ShellComplete(app, {}, 'awarenav', 'X').get_completions([], ''); "
        "print([each for each in sys.modules if each.endswith('.command')])"
    )
    assert run_python(code).stdout == "[]\n"


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["models", ""], ["list", "verify", "fetch"]),
        (["models", "fetch", "--ou"], ["--out"]),
        (["crossings", "--scenario", "crowd"], ["crowd_of_eight"]),
        (["crossings", "--policy", "b"], ["balanced", "blind"]),
        (["crossings", "--fault", "gh"], ["ghosts"]),
        (["crossings", "--camera", "su"], ["surround"]),
        (["crossings", "--perception", "k"], ["keypoints"]),
        (["falsify", "--robot", "fork"], ["forklift"]),
        (["policy", "show", "blind", "ba"], ["balanced"]),
        (["completion", "z"], ["zsh"]),
        (["nowhere", "x"], []),
        (["crossings", "--episodes", "none", "--see"], ["--seed"]),
    ],
)
def test_words_are_completed_by_their_beginning(words, names):
    assert values(*words) == names


def test_paths_are_left_to_the_shell():
    assert [item.type for item in offered("crossings", "--policy", "./mi")] == ["file"]
    assert [item.type for item in offered("crossings", "--out", "")] == ["dir"]
