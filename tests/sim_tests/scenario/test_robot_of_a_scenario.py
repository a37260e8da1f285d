"""Scenarios are checked and planned with the body and the limits of their own robot."""

import numpy as np
import pytest

from sim_tests import NOVA_CARTER, Scenario, shipped_scenarios
from sim_tests.scenario.catalogue import closest_approaches, robot_plan, scenario_problems

RACK = {"x_m": 2.0, "y_m": 0.0, "length_m": 1.0, "width_m": 1.0}


def facing_a_rack(robot: str | None, start_x_m: float) -> tuple[str, ...]:
    """Return the problems of a robot that starts in front of a rack whose face is at x = 1.5 m."""
    data = {
        "name": "rack",
        "duration_s": 9.0,
        "layout": {"x_min_m": -9.0, "y_min_m": -5.0, "x_max_m": 9.0, "y_max_m": 5.0},
        "robot": {"start_x_m": start_x_m, "goal_x_m": -4.0},
        "robot_model": robot,
    }
    data["layout"]["racks"] = [RACK]  # type: ignore[index]
    return scenario_problems(Scenario.model_validate(data))


def test_a_long_robot_needs_more_room_at_its_start() -> None:
    assert facing_a_rack(None, 1.0) == ()
    (problem,) = facing_a_rack("forklift", 1.0)
    assert "the robot's start at (1, 0) m is in, or nearer than 1.3" in problem
    assert facing_a_rack("forklift", 0.0) == ()
    # A small robot has room where the Nova Carter has none.
    assert facing_a_rack("delivery", 1.1) == ()
    assert facing_a_rack(None, 1.1) != ()


@pytest.mark.parametrize("robot", ["forklift", "omni"])
def test_every_fitted_scenario_passes_with_its_robot(robot: str) -> None:
    for name in shipped_scenarios():
        fitted = Scenario.shipped(name).draw(0).with_robot(robot)
        assert scenario_problems(fitted) == (), name


def test_the_plan_has_the_speed_of_the_robot() -> None:
    before = Scenario.shipped("crossing_from_left").draw(0)
    slow = before.model_copy(update={"robot_model": before.with_robot("delivery").robot_model})
    assert slow.robot_profile.max_speed_mps == 1.0
    assert before.robot_profile is NOVA_CARTER
    t_s = np.array([0.0, 6.0])
    driven_m = robot_plan(slow.robot, t_s, slow.robot_profile)[1, 0] - slow.robot.start_x_m
    assert driven_m < 6.0
    # It comes later to the place where somebody crosses.
    assert closest_approaches(slow) != closest_approaches(before)
