"""Outputs that are not UTF-8, file names that are not, and files of another kind."""

from __future__ import annotations

import io
import json
import os
import sys
from pathlib import Path

import pytest
from paths import ROOT

from awarenav.cli import main

TABLE = "t_s,id,x_m,y_m\n" + "".join(f"{0.1 * k:.1f},bén,{0.1 * k:.2f},0\n" for k in range(12))
POLICY = ROOT / "nav_adapter/policies/balanced.yaml"
ROBOT = ROOT / "docs/nav2/robot.yaml"
SCENARIO = ROOT / "sim_tests/scenario/shipped/late_glance.yaml"


def printed(
    words: list[str], encoding: str, monkeypatch: pytest.MonkeyPatch, status: int = 0
) -> str:
    """Return what a command prints to outputs of this encoding."""
    streams = {name: io.TextIOWrapper(io.BytesIO(), encoding) for name in ("stdout", "stderr")}
    for name, stream in streams.items():
        monkeypatch.setattr(sys, name, stream)
    assert main(words) == status
    for stream in streams.values():
        stream.flush()
    monkeypatch.undo()
    return "".join(stream.buffer.getvalue().decode(encoding) for stream in streams.values())


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp437", "utf-8"])
def test_every_output_takes_every_letter(encoding: str, tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "people – α.csv"
    path.write_text(TABLE, encoding="utf-8")
    words = ["tracks", str(path), "--out", "none", "--csv", str(tmp_path / "α.csv")]
    text = printed(words, encoding, monkeypatch)
    mean = "mean α" if encoding in ("cp437", "utf-8") else r"mean \u03b1"
    assert mean in text
    assert ("bén" if encoding != "ascii" else r"b\u00e9n") in text
    assert (tmp_path / "α.csv").exists()
    for other in (["tracks", "--help"], ["policy", "show", "balanced", "--out", "none"]):
        assert printed(other, encoding, monkeypatch)
    gone = printed(["tracks", "→.csv", "--out", "none"], encoding, monkeypatch, status=2)
    assert "cannot read" in gone


def test_a_process_without_outputs_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A daemon may have none."""
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    assert main(["policy", "show", "balanced", "--out", str(tmp_path / "policy.png")]) == 0
    assert main(["policy", "show", "none"]) == 2
    assert (tmp_path / "policy.png").exists()


def test_json_stays_the_same_document(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "m→é𝛼.yaml"
    path.write_bytes(POLICY.read_bytes())
    words = ["policy", "show", str(path), "--json", "--out", "none"]
    found = [json.loads(printed(words, each, monkeypatch)) for each in ("ascii", "utf-8")]
    assert found[0] == found[1]
    assert str(path) in json.dumps(found[0], ensure_ascii=False)


@pytest.fixture
def latin(tmp_path: Path) -> Path:
    """A folder whose name is not UTF-8, as old archives have them."""
    folder = tmp_path / os.fsdecode(b"l\xe4ute")
    try:
        folder.mkdir()
    except OSError:  # such as on macOS
        pytest.skip("this file system has no such names")
    return folder


def test_a_file_name_that_is_not_utf_8_is_only_a_name(latin: Path, capsys) -> None:
    path = latin / os.fsdecode(b"l\xe4ute.csv")
    path.write_text(TABLE, encoding="utf-8")
    words = ["--out", str(latin / "plot.png"), "--csv", str(latin / os.fsdecode(b"\xe4.csv"))]
    assert main(["tracks", str(path), *words]) == 0
    assert (latin / "plot.png").stat().st_size > 10_000
    task = ["--start", "0", "-5", "--goal", "8", "-5"]
    made = latin / "made.yaml"
    assert main(["scenario", "from-recording", str(path), *task, "--out", str(made)]) == 0
    assert "People of l?ute.csv" in made.read_text("utf-8")
    assert main(["scenario", "validate", str(made)]) == 0
    capsys.readouterr()
    bad = latin / os.fsdecode(b"\xe4.yaml")
    assert main(["scenario", "from-recording", str(path), *task, "--out", str(bad)]) == 2
    assert "must have a name in UTF-8" in capsys.readouterr().err
    assert not bad.exists()


def test_a_policy_with_such_a_name_is_drawn(latin: Path) -> None:
    path = latin / os.fsdecode(b"m\xe4.yaml")
    path.write_bytes(POLICY.read_bytes())
    assert main(["policy", "show", str(path), "--out", str(latin / "policy.svg")]) == 0
    assert (latin / "policy.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "file", "kind"),
    [
        (["scenario", "validate"], POLICY, ": this is a policy, no scenario"),
        (["scenario", "validate"], ROBOT, ": this is the file of a robot, no scenario"),
        (["scenario", "draw"], POLICY, ": this is a policy, no scenario"),
        (
            ["policy", "show"],
            SCENARIO,
            ": this is a scenario; unknown key 'name' in Aw",
        ),
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


def test_a_misspelt_key_is_still_named_with_the_nearest(tmp_path: Path, capsys) -> None:
    own = tmp_path / "mine.yaml"
    own.write_text(POLICY.read_text().replace("inflation:", "inflations:"))
    assert main(["policy", "show", str(own)]) == 2
    assert "did you mean 'inflation'" in capsys.readouterr().err
