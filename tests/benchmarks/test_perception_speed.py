"""The benchmark of perception measures every figure of its baseline."""

from __future__ import annotations

from pathlib import Path

import pytest

from awarenav.baseline import read_baseline

pytest.importorskip("pybullet", reason="the clip is rendered (extra sim)")

from benchmarks.perception_speed import BASELINE, main


@pytest.mark.full
def test_every_figure_of_the_baseline_is_measured(tmp_path: Path) -> None:
    out = tmp_path / "figures.json"
    assert main(["--frames", "2", "--out", str(out)]) in (0, 1)  # a slow computer may miss one
    figures = read_baseline(out)
    assert figures.keys() == read_baseline(BASELINE).keys()
    assert all(figure.value > 0.0 for figure in figures.values())
