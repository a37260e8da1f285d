"""Results print on a screen, however long the episode."""

import math

import pytest

from nav_adapter import NavConstraints
from sim_tests import Scenario, run_crossing
from sim_tests.study.measures import measure, summarise

LINES, COLUMNS = 10, 100


@pytest.fixture(scope="module")
def result():
    crowd = Scenario.shipped("crowd_of_eight").model_copy(update={"duration_s": 4.0})
    return run_crossing(crowd, policy="balanced", perception="keypoints", seed=0)


def lines(value):
    return sum(max(1, math.ceil(len(line) / COLUMNS)) for line in repr(value).splitlines())


def test_the_repr_of_a_result_fits_a_screen(result):
    record = measure(result)
    summary = summarise([record])
    fullest = max(result.frames, key=lambda frame: len(frame.constraints.obstacles))
    assert len(fullest.constraints.obstacles) > 3
    for value in (result, fullest, fullest.constraints, record, summary, *summary.policies):
        assert lines(value) <= LINES, repr(value)


def test_the_repr_of_a_result_says_how_it_went(result):
    text = repr(result)
    for part in (
        "CrossingResult(scenario='crowd_of_eight', seed=0, policy='balanced'",
        f"success={result.success}",
        f"min_separation_m={result.min_separation_m:.6g}",
        f"frames=<{len(result.frames)} CrossingFrame>",
    ):
        assert part in text


def test_few_obstacles_are_printed_and_many_are_counted(result):
    fullest = max((frame.constraints for frame in result.frames), key=lambda c: len(c.obstacles))
    assert f"obstacles=<{len(fullest.obstacles)} PersonObstacle>" in repr(fullest)
    first = fullest.obstacles[0]
    one = NavConstraints(0.0, (first,), 1.0, "x" * 200, False)
    assert repr(one).startswith(f"NavConstraints(stamp_s=0, obstacles=({first!r},), speed_limit")
    assert "limited_by='xxx" in repr(one)
    assert "…, stale=False" in repr(one)
    assert f"center_odom_m=[{first.center_odom_m[0]:.6g}, " in repr(first)
    assert "polygon" not in repr(first)
