"""Refusals of planners, and what is said about a command that is none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from planner_scenes import DT_S, ROBOT, at_rest, constraints

from sim_tests import Scenario, SimError, run_crossing
from sim_tests.crossing.planner import ReferencePlanner

EMPTY = Scenario.model_validate(
    {
        "name": "empty",
        "description": "Half a second in an empty hall.",
        "duration_s": 0.5,
        "control_hz": 10.0,
        "layout": {"x_min_m": -3.0, "y_min_m": -3.0, "x_max_m": 6.0, "y_max_m": 3.0},
        "robot": {"goal_x_m": 2.0},
        "people": [],
    }
)


class Returns:
    """A planner that always returns the same."""

    def __init__(self, command):
        self.command = command

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return self.command


def cross(planner):
    return run_crossing(EMPTY, policy="blind", planner=planner)


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"goal": (math.nan, 0.0)}, "goal_odom_m"),
        ({"goal": (1.0, 2.0, 3.0)}, "goal_odom_m"),
        ({"goal": "home"}, "goal_odom_m"),
        ({"dt_s": 0.0}, "dt_s"),
        ({"dt_s": math.inf}, "dt_s"),
        ({"boxes": [[0, 0, 0, 1]]}, "static_boxes_odom_m"),
        ({"boxes": [[0, 0, 1, math.nan]]}, "static_boxes_odom_m"),
    ],
)
def test_unusable_arguments_are_refused_by_name(changed, name):
    given = {"goal": (8.0, 0.0), "dt_s": DT_S, "boxes": None, **changed}
    with pytest.raises(SimError, match=name):
        ReferencePlanner(ROBOT, given["boxes"]).plan(
            at_rest(), given["goal"], constraints([]), given["dt_s"]
        )


@pytest.mark.parametrize(
    "command",
    [[0.5, 0.25], np.array([0.5, 0.25], dtype=np.float32), (np.float32(0.5), np.array(0.25))],
    ids=repr,
)
def test_two_numbers_are_a_command_in_any_array_type(command):
    frames = cross(Returns(command)).frames
    assert {frame.command for frame in frames} == {(0.5, 0.25)}
    assert all(type(cell) is float for cell in frames[0].command)


@pytest.mark.parametrize(
    ("command", "described"),
    [
        (None, r"None \(NoneType\)"),
        ((0.5,), r"\(0\.5,\) \(tuple\)"),
        ((0.5, 0.0, 0.0), r"\(0\.5, 0\.0, 0\.0\) \(tuple\)"),
        ((np.nan, 0.0), r"\(nan, 0\.0\) \(tuple\)"),
        (("0.5", "0"), r"\('0\.5', '0'\) \(tuple\)"),
        ((True, False), r"\(True, False\) \(tuple\)"),
        ({"speed_mps": 0.5, "yaw_rate_radps": 0.0}, r"\{'speed_mps': .*\(dict\)"),
        (np.zeros((2, 1)), r"\(ndarray of shape \(2, 1\)\)"),
        ([0.5, 1j], r"\(list\)"),
        (list(range(1000)), r"\[0, 1, .{60,80}… \(list\)"),
    ],
)
def test_any_other_command_is_refused_with_what_was_returned(command, described):
    message = (
        f"^planner Returns returned .*{described} at 0.00 s; plan must return "
        r"\(speed_mps, yaw_rate_radps\), two finite numbers in m/s and rad/s$"
    )
    with pytest.raises(SimError, match=message):
        cross(Returns(command))


def test_what_is_no_planner_is_refused_and_an_error_of_a_planner_is_its_own():
    class Raises:
        def plan(self, *_):
            raise LookupError("lost")

    with pytest.raises(LookupError, match="lost"):
        cross(Raises())
    with pytest.raises(SimError, match=r"got the class Returns: make one with Returns\("):
        cross(Returns)
    with pytest.raises(SimError, match="must be an object with plan"):
        cross(0.5)
