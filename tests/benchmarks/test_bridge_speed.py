"""The benchmark of the bridge gives figures, or a message if it cannot."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from benchmarks.bridge.__main__ import main


@pytest.fixture(autouse=True)
def as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Undo the network and the cores that the benchmark sets for its process."""
    monkeypatch.setenv("CYCLONEDDS_URI", os.environ.get("CYCLONEDDS_URI", ""))
    if hasattr(os, "sched_setaffinity"):
        monkeypatch.setattr(os, "sched_setaffinity", lambda pid, cores: None)


@pytest.mark.full
def test_every_figure_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pybullet", reason="the extra sim is not installed")
    out = tmp_path / "figures.json"
    # A slow computer may miss the goal (1), but there are figures.
    assert main(["--seconds", "2", "--rate", "10", "--out", str(out)]) in (0, 1)
    said = capsys.readouterr().out
    assert "1 of 1 people confirmed" in said
    lines = [line.split() for line in said.splitlines() if line.startswith("bridge_")]
    figures = {name: float(value) for name, value, _ in lines}
    assert 0.0 < figures["bridge_pictures_per_s"] <= 12.0
    # The networks alone take at least this long on any computer.
    assert figures["bridge_cpu_per_picture"] > 1.0
    assert figures["bridge_latency"] > 1.0
    assert "bridge_latency" in out.read_text()


def test_a_folder_without_images_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--render", str(tmp_path)]) == 2
    assert "truth.jsonl" in capsys.readouterr().err
