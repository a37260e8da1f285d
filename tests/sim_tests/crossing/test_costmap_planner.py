"""The planner ``costmap``: it knows where people are, and not that they walk."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from planner_scenes import AISLE, DT_S, constraints

from nav_adapter import RobotProfile, RobotState
from sim_tests import Scenario, run_crossing
from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing.planner import CostmapPlanner, ReferencePlanner
from sim_tests.study.runs import plan_jobs, policy_of

GOAL = np.array([8.0, 0.0])
DRIVING = RobotState(0.0, np.zeros(2), 0.0, 1.2, 0.0)


def among(place: tuple[float, float], velocity: tuple[float, float], limit_mps: float = 1.5):
    return constraints([(place, velocity, 0.45)], limit_mps)


@given(
    x_m=st.floats(0.9, 6.0),
    y_m=st.floats(-2.0, 2.0),
    speed_mps=st.floats(0.0, 2.0),
    course=st.floats(-math.pi, math.pi),
)
def test_a_velocity_changes_no_command(
    x_m: float, y_m: float, speed_mps: float, course: float
) -> None:
    velocity = speed_mps * math.cos(course), speed_mps * math.sin(course)
    walking, standing = (
        CostmapPlanner(NOVA_CARTER, AISLE).plan(DRIVING, GOAL, among((x_m, y_m), each), DT_S)
        for each in (velocity, (0.0, 0.0))
    )
    assert walking == standing


def test_the_reference_planner_lets_somebody_pass_whom_it_does_not_see_coming() -> None:
    crossing = among((3.0, -2.5), (0.0, 1.3))
    reference, costmap = (
        planner(NOVA_CARTER).plan(DRIVING, GOAL, crossing, DT_S)
        for planner in (ReferencePlanner, CostmapPlanner)
    )
    assert costmap[0] == pytest.approx(1.25)  # as fast as it may
    assert costmap[0] > reference[0] + 0.08


@given(limit_mps=st.floats(0.0, 1.5), y_m=st.floats(-1.5, 1.5))
def test_it_keeps_the_limit_of_its_policy(limit_mps: float, y_m: float) -> None:
    slow = replace(DRIVING, speed_mps=min(limit_mps, 0.5))
    speed, _ = CostmapPlanner(NOVA_CARTER).plan(
        slow, GOAL, among((4.0, y_m), (0.0, 1.0), limit_mps), DT_S
    )
    assert 0.0 <= speed <= limit_mps + 1e-9


def test_costs_near_obstacles_are_those_of_nav2s_inflation_layer() -> None:
    planner = CostmapPlanner(NOVA_CARTER)
    assert planner.person_comfort_m == planner.box_comfort_m == pytest.approx(0.55 - 0.25)
    gap_m = np.linspace(0.0, 1.0, 1001)
    nav2 = np.where(gap_m < 0.30, np.exp(-10.0 * gap_m), 0.0)
    ours = np.maximum(1.0 - gap_m / planner.person_comfort_m, 0.0) ** 2
    assert np.abs(nav2 - ours).max() < 0.1
    # Of a robot that is wider than the inflation, one cell remains.
    wide = RobotProfile(2.5 * NOVA_CARTER.footprint_m, 1.5, 1.0, 1.0, 0.3)
    assert CostmapPlanner(wide).person_comfort_m == 0.05


@pytest.mark.slow
def test_its_name_runs_it_beside_the_policy_of_today() -> None:
    (job,) = plan_jobs(
        ["reads_phone"], ["scanner"], [2000], planners=["costmap"], sensors=["scanner"]
    )
    assert (job.planner_text, job.policy, job.perception) == ("costmap", "scanner", "scanner")
    scenario = Scenario.shipped("reads_phone").draw(2000)
    blind, seeing = (
        run_crossing(
            scenario,
            policy=policy_of(job.policy_text),
            planner=planner(scenario.robot_profile, scenario.planner_boxes_odom_m),
            perception="truth",
            seed=2000,
        )
        for planner in (CostmapPlanner, ReferencePlanner)
    )
    assert [contact for contact in blind.contacts if contact.by == "robot"]
    assert not [contact for contact in seeing.contacts if contact.by == "robot"]
