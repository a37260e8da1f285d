"""The fastest drive under limits that are known in advance, and the page that tells of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.floor import PAGE, fastest_s, limits_mps, page, table, ways
from sim_tests import run_crossing
from sim_tests.study.runs import named_scenarios


@pytest.mark.parametrize(("limit_mps", "gains", "brakes"), [(1.5, 1.0, 1.5), (0.6, 0.5, 1.0)])
def test_a_constant_limit_takes_the_time_of_a_trapezoid(
    limit_mps: float, gains: float, brakes: float
) -> None:
    fastest = fastest_s(np.full((200, 101), limit_mps), gains, brakes)
    trapezoid = 10.0 / limit_mps + 0.5 * limit_mps * (1.0 / gains + 1.0 / brakes)
    assert fastest == pytest.approx(trapezoid, abs=0.4)


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 1.0))
def test_higher_limits_never_take_longer(seed: int, more_mps: float) -> None:
    limits = np.random.default_rng(seed).choice([-1.0, 0.0, 0.5, 1.0], (60, 21))
    assert fastest_s(limits + more_mps, 1.0, 1.0) <= fastest_s(limits, 1.0, 1.0)


def drive_s(limits: np.ndarray, gains: int, brakes: int) -> float:
    """Return the time of the fastest drive by trying every one, in steps of 0.1 m/s and 0.01 m."""
    last = (limits.shape[1] - 1) * 10
    states = {(0, 0)}
    for step, limit in enumerate(limits[1:], start=1):
        after = set()
        for at, was in states:
            for speed in range(max(was - brakes, 0), was + gains + 1):
                there = at + was + speed
                if there <= last:
                    most = round(limit[(there + 5) // 10] * 10)
                    if speed == 0 or speed <= most or (speed == was - brakes and most >= 0):
                        after.add((there, speed))
        states = after
        if any(at > last - 10 and speed <= brakes for at, speed in states):
            return step * 0.2
    return math.inf


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 4))
def test_no_drive_is_faster_and_one_is_as_fast(seed: int, gains: int, brakes: int) -> None:
    """Also on ways that are shorter than a step."""
    random = np.random.default_rng(seed)
    shape = random.integers(8, 30), random.integers(2, 12)
    limits = random.choice([-1.0, 0.0, 0.3, 0.6, 1.0], shape, p=[0.1, 0.1, 0.2, 0.2, 0.4])
    fastest = fastest_s(limits, gains * 0.5, brakes * 0.5)
    assert fastest == pytest.approx(drive_s(limits, gains, brakes))


def test_a_robot_waits_before_a_body_until_it_has_left() -> None:
    limits = np.full((100, 51), 1.0)
    limits[:50, 25:30] = -1.0  # for ten seconds
    free = fastest_s(np.full((100, 51), 1.0), 1.0, 1.0)
    assert 10.0 + 2.0 < fastest_s(limits, 1.0, 1.0) < 10.0 + free
    limits[:, 25:30] = -1.0
    assert math.isinf(fastest_s(limits, 1.0, 1.0))


def test_nobody_is_driven_through() -> None:
    (scenario,) = named_scenarios(["standing_in_aisle"])
    scenario = scenario.draw(0)
    frames = run_crossing(scenario, policy="scanner").frames[::40]
    straight, *_ = ways(scenario)
    limits = limits_mps(frames, straight)
    body = frames[0].truth[0].position_odom_m
    nearest = int(np.hypot(*(straight.places_m - body).T).argmin())
    assert (limits[:, nearest] == -1.0).all()
    assert limits[0, 0] > 0.0


def test_the_page_has_the_table_of_the_committed_rows() -> None:
    """After another drive: python -m benchmarks.floor."""
    text = PAGE.read_text(encoding="utf-8")
    assert table() in text
    assert page(text) == text
