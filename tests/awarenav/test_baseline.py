"""Baselines of measured figures."""

from __future__ import annotations

from pathlib import Path

import pytest

from awarenav.baseline import MeasuredValue, read_baseline, worse_than, write_baseline
from awarenav.errors import AwarenavError


def test_baselines_round_trip_and_judge(tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    fast, slow = (MeasuredValue("speed", value, "x", "higher", 0.2) for value in (10.0, 7.0))
    write_baseline(path, [fast])
    baseline = read_baseline(path)
    assert baseline == {"speed": fast}
    assert worse_than(baseline, [fast]) == []
    assert worse_than(baseline, [slow]) == ["speed: 7 x, 10 before"]
    cost = MeasuredValue("cost", 1.0, "ms", "lower", 0.1)
    assert MeasuredValue("cost", 1.2, "ms", "lower", 0.1).is_worse_than(cost)
    assert not MeasuredValue("cost", 1.05, "ms", "lower", 0.1).is_worse_than(cost)


@pytest.mark.parametrize("text", ["{", "{}", '{"metrics": [{"name": "a"}]}'])
def test_files_that_are_not_baselines_are_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "baseline.json"
    path.write_text(text)
    with pytest.raises(AwarenavError, match="not a baseline"):
        read_baseline(path)
