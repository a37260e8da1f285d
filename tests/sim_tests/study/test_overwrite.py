"""A finished set of images is replaced on request only, and an interrupted one goes on."""

from __future__ import annotations

import pytest

from awarenav.cli import main

RENDER = ["render", "--frames", "2", "--scenes", "1", "--size", "64x48", "--processes", "1"]


def results(folder):
    return {
        path.name: path.read_bytes()
        for pattern in ("*.png", "*.jsonl")
        for path in folder.glob(pattern)
    }


@pytest.fixture
def command(tmp_path):
    return [*RENDER, "--out", str(tmp_path / "out")]


def test_a_finished_set_is_not_overwritten_unasked(command, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(command) == 0
    before = results(out)
    assert before
    capsys.readouterr()
    assert main(command) == 2
    message = capsys.readouterr().err
    for remedy in ("--resume", "--overwrite", "--out"):
        assert remedy in message
    assert main([*command, "--resume"]) == 0
    assert results(out) == before
    (out / "mine.txt").write_text("mine")
    # Another seed: no image of the first set may be used again.
    assert main([*command, "--seed", "5", "--overwrite"]) == 0
    assert results(out).keys() == before.keys()
    assert results(out) != before
    assert (out / "mine.txt").read_text() == "mine"


def test_an_interrupted_set_goes_on_and_there_must_be_one_to_resume(command, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([*command, "--resume"]) == 2
    assert "there are no images" in capsys.readouterr().err
    assert not out.exists()
    assert main(command) == 0
    before = results(out)
    (out / "000001.png").unlink()
    assert main(command) == 0
    assert results(out) == before
