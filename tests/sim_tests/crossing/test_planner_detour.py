"""The side on which the reference planner passes somebody who stands in its way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from planner_scenes import DT_S, ROBOT, constraints, drive

from nav_adapter import RobotState
from sim_tests.crossing.planner import SamplingPlanner


def headings_rad(
    state: RobotState, person: tuple[float, float, float], boxes: list[list[float]], ticks: int
) -> list[float]:
    """Return the headings of a robot at 0.5 m/s or less beside a person x, y, radius who stands."""
    x, y, radius_m = person
    now = constraints([((x, y), (0.0, 0.0), radius_m)], 0.5)
    planner = SamplingPlanner(ROBOT, np.array(boxes))
    headings = []
    for _ in range(ticks):
        state = drive(state, planner.plan(state, (12.0, 0.0), now, DT_S))
        headings.append(state.heading_odom_rad)
    return headings


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["right", "left"])
def test_a_slow_robot_does_not_turn_to_the_blocked_far_side_of_an_aisle(side: float) -> None:
    walls = [[-5.0, 1.75, 17.0, 2.0], [-5.0, -2.0, 17.0, -1.75]]
    state = RobotState(0.0, (5.9, side * 0.95), -side * math.radians(3.0), 0.2, 0.0)
    headings = headings_rad(state, (7.8, 0.0, 1.19), walls, 60)
    assert (side * np.array(headings)).min() > -math.radians(30.0)


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["right", "left"])
def test_a_slow_robot_keeps_off_the_side_that_a_rack_beside_the_person_blocks(side: float) -> None:
    person = (4.0, -side * 0.3, 0.7)  # this side would be nearer
    state = RobotState(0.0, (0.0, 0.0), 0.0, 0.4, 0.0)
    rack = sorted([side * 0.95, side * 3.0])
    assert side * headings_rad(state, person, [[3.0, rack[0], 5.0, rack[1]]], 10)[-1] < 0.0
