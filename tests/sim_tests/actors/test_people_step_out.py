"""People who stand beside the robot's way and set off across it as the robot comes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from staged_people import StageRun, run_stage

from sim_tests import Scenario
from sim_tests.actors.robot import NOVA_CARTER

FRONT_M = float(NOVA_CARTER.footprint_m[:, 0].max())
BESIDE = {
    "name": "p",
    "route": [{"x_m": 7.0, "y_m": 1.0}, {"x_m": 7.0, "y_m": -3.5}],
    "heading_deg": -90.0,
    "social": False,
    "glances": {"notices_within_m": 0.0},
}


def start_row(run: StageRun) -> int:
    """Return the row of the first time at which the person moves."""
    return int(np.flatnonzero(run.speeds[:, 0] > 0.02)[0])


@pytest.mark.parametrize("within_m", [0.3, 4.0])
@pytest.mark.parametrize("robot_mps", [0.4, 1.0])
def test_the_moment_counts_from_the_robot_at_any_speed(within_m: float, robot_mps: float) -> None:
    seconds = (7.0 - within_m) / robot_mps + 3.0
    person = {**BESIDE, "sets_off_within_m": within_m}
    run = run_stage([person], robot_mps=robot_mps, seconds=seconds)
    row = start_row(run)
    gap_m = 7.0 - run.robot[row, 0] - FRONT_M
    # Decisions are 0.05 s apart, and so are the rows.
    assert within_m - 0.15 * robot_mps <= gap_m <= within_m + 0.01
    assert run.people[:row, 0, :2] == pytest.approx(np.tile([7.0, 1.0], (row, 1)), abs=0.01)
    if within_m == 4.0:  # past the robot before it comes
        assert run.speeds.max() == pytest.approx(1.34, abs=0.05)


def test_the_line_may_lie_at_any_angle_and_counts_past_the_robot_too() -> None:
    """Along a diagonal the nearest corner of the robot counts, on either side of the line."""
    diagonal = [{"x_m": 7.0, "y_m": 1.0}, {"x_m": 5.0, "y_m": -1.0}]
    person = {**BESIDE, "route": diagonal, "sets_off_within_m": 0.5}
    run = run_stage([person], robot_mps=0.6, seconds=12.0)
    x_m, y_m = run.robot[start_row(run)]
    corner_m = (6.0 - x_m + y_m) / math.sqrt(2.0)  # of the base from the line x - y = 6 m
    corner_m -= (FRONT_M + float(NOVA_CARTER.footprint_m[:, 1].max())) / math.sqrt(2.0)
    assert corner_m == pytest.approx(0.5, abs=0.08)


def test_without_the_robot_they_stay_and_nothing_counts_as_lost() -> None:
    run = run_stage([{**BESIDE, "sets_off_within_m": 2.0}], robot_mps=0.0, seconds=6.0)
    assert run.speeds.max() < 0.02
    (outcome,) = run.outcomes
    assert (outcome.time_s, outcome.late_s) == (None, None)
    met = run_stage([{**BESIDE, "sets_off_within_m": 4.0}], robot_mps=0.6, seconds=14.0)
    (outcome,) = met.outcomes
    assert outcome.time_s is not None
    assert outcome.free_time_s is not None
    # The wait for the robot is not time that the robot cost them.
    assert outcome.time_s == pytest.approx(outcome.free_time_s, abs=0.2)


@pytest.mark.parametrize("population", ["classic", "recorded"])
def test_who_has_watched_looks_away_and_forgets_the_robot(population: str) -> None:
    person = {
        **BESIDE,
        "heading_deg": -130.0,
        "glances": {"watches": True},
        "reactions": {"wait": 1.0},
        "as_written": True,
        "sets_off_within_m": 1.0,
    }
    run = run_stage([person], robot_mps=0.8, seconds=12.0, population=population)
    (outcome,) = run.outcomes
    assert outcome.noticed_s is not None
    # Somebody who waits may step back a little before.
    row = int(np.flatnonzero(run.people[:, 0, 3] < -0.2)[0])
    left_s = float(run.times_s[row])
    assert outcome.noticed_s < left_s - 2.0
    assert 7.0 - run.robot[row, 0] - FRONT_M == pytest.approx(1.0, abs=0.2)
    off_deg = run.off_robot_deg[:, 0]
    watched = (run.times_s > left_s - 1.5) & (run.times_s < left_s - 0.5)
    assert off_deg[watched].max() < 20.0
    # The head turns to the way at once, and they wait for nobody.
    assert off_deg[row + 10] > 30.0
    assert run.people[row : row + 30, 0, 1].min() < 0.5


def test_the_shipped_ones_draw_the_moment_over_the_whole_approach() -> None:
    scenario = Scenario.shipped("steps_out_near")
    drawn_m = [scenario.draw(seed).people[0].sets_off_within_m for seed in range(150)]
    assert 0.3 <= min(drawn_m) < 0.4
    assert 3.0 < max(drawn_m) <= 4.0
    assert np.quantile(drawn_m, [0.25, 0.75]) == pytest.approx([0.8, 1.8], abs=0.25)
