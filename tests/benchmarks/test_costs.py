"""Benchmarks of cost and speed: they give every figure, and refuse what they cannot measure."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from awarenav.baseline import read_baseline
from benchmarks.episode_cost import main as episode_cost
from benchmarks.people.__main__ import main as people


@pytest.mark.parametrize(
    ("main", "arguments", "message"),
    [
        (people, ["--crowds", "0"], "must be a whole number of at least 1, got '0'"),
        (people, ["--seed", "-3"], "--seed must be 0 or more, got -3"),
        (people, ["--out", "no/such/folder/x.json"], "a folder that exists"),
        (people, ["--baseline", "HERE/broken.json"], "is not a baseline"),
        (episode_cost, ["--against", "HERE"], "must be a checkout with sim_tests"),
    ],
)
def test_bad_input_is_refused(
    main: Callable[[Sequence[str]], int],
    arguments: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "broken.json").write_text(json.dumps({}))
    with pytest.raises(SystemExit) as stopped:
        main([each.replace("HERE", str(tmp_path)) for each in arguments])
    assert stopped.value.code == 2
    assert message in capsys.readouterr().err


@pytest.mark.full
def test_a_checkout_has_the_results_of_itself(capsys: pytest.CaptureFixture[str]) -> None:
    here = str(Path(__file__).resolve().parents[2])
    arguments = ["--episodes", "1", "--perception", "truth", "--scenario", "crossing_attentive"]
    assert episode_cost([*arguments, "--against", here]) == 0
    *_, row, mean = capsys.readouterr().out.splitlines()
    _, perception, scenario, before, now, ratio, same, _ = (cell.strip() for cell in row.split("|"))
    assert (perception, scenario, same) == ("`truth`", "`crossing_attentive`", "yes")
    assert float(before) > 0.0
    assert float(now) / float(before) == pytest.approx(float(ratio), rel=0.1)
    assert mean.startswith("| `truth` | mean |")


@pytest.mark.full
def test_every_figure_of_perception_is_measured(tmp_path: Path) -> None:
    pytest.importorskip("pybullet", reason="the clip is rendered (extra sim)")
    from benchmarks.perception_speed import BASELINE, main  # noqa: PLC0415

    out = tmp_path / "figures.json"
    assert main(["--frames", "2", "--out", str(out)]) in (0, 1)  # a slow computer may miss one
    figures = read_baseline(out)
    assert figures.keys() == read_baseline(BASELINE).keys()
    assert all(figure.value > 0.0 for figure in figures.values())


@pytest.fixture
def bridge(monkeypatch: pytest.MonkeyPatch) -> Callable[[Sequence[str]], int]:
    """The benchmark of the bridge; the network and cores that it sets are undone."""
    pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")
    from benchmarks.bridge.__main__ import main  # noqa: PLC0415

    monkeypatch.setenv("CYCLONEDDS_URI", os.environ.get("CYCLONEDDS_URI", ""))
    if hasattr(os, "sched_setaffinity"):
        monkeypatch.setattr(os, "sched_setaffinity", lambda pid, cores: None)
    return main


@pytest.mark.full
def test_every_figure_of_the_bridge_is_measured(
    bridge, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pybullet", reason="the extra sim is not installed")
    out = tmp_path / "figures.json"
    # A slow computer may miss the goal (1), but there are figures.
    assert bridge(["--seconds", "2", "--rate", "10", "--out", str(out)]) in (0, 1)
    said = capsys.readouterr().out
    assert "1 of 1 people confirmed" in said
    lines = [line.split() for line in said.splitlines() if line.startswith("bridge_")]
    figures = {name: float(value) for name, value, _ in lines}
    assert 0.0 < figures["bridge_pictures_per_s"] <= 12.0
    # The networks alone take at least this long on any computer.
    assert figures["bridge_cpu_per_picture"] > 1.0
    assert figures["bridge_latency"] > 1.0
    assert "bridge_latency" in out.read_text()


def test_a_folder_without_images_is_refused_by_the_bridge(
    bridge, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bridge(["--render", str(tmp_path)]) == 2
    assert "truth.jsonl" in capsys.readouterr().err
