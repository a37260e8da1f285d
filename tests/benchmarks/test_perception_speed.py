"""Pass and fail of benchmarks/perception_speed.py; its figures are measured, not tested."""

from __future__ import annotations

import importlib.util
import sys

import pytest
from paths import ROOT

from awarenav.baseline import MeasuredValue

SCRIPT = ROOT / "benchmarks" / "perception_speed.py"


@pytest.fixture(scope="module")
def benchmark():
    spec = importlib.util.spec_from_file_location("perception_speed", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    try:
        spec.loader.exec_module(module)
        yield module
    finally:
        del sys.modules[spec.name]


@pytest.mark.parametrize(
    ("ours_ms", "good"), [(0.5, True), (0.999, True), (1.0, False), (2, False)]
)
def test_a_higher_cost_than_the_peer_fails_without_a_baseline(benchmark, ours_ms, good):
    text, verdict = benchmark.report(benchmark.compared("pose", ours_ms, 1.0), {})
    assert verdict is good
    assert ("MORE THAN RTMLIB" in text) is not good


def test_a_figure_worse_than_the_baseline_fails(benchmark):
    before = {"speed": MeasuredValue("speed", 40.0, "frames/s", "higher", 0.5)}
    for value, good in ((30.0, True), (10.0, False)):
        now = [MeasuredValue("speed", value, "frames/s", "higher", 0.5)]
        assert benchmark.report(now, before)[1] is good
