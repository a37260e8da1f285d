"""Planners of the user's own are called with what they ask for."""

import numpy as np
import pytest
from run_planners import READY
from run_scenes import short

from sim_tests import NOVA_CARTER, SimError
from sim_tests.crossing.planner import make_planner
from sim_tests.study.runs import plan_jobs


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("Init", ()),
        ("Robot", (NOVA_CARTER,)),
        ("AnyName", (NOVA_CARTER, 2.0)),
        ("Seed", (7,)),
        ("PositionalOnly", (2.0, 5)),
        ("AnyName(gain=0.3)", (NOVA_CARTER, 0.3)),
        ("function", (7,)),
    ],
)
def test_a_planner_is_called_with_what_its_signature_asks_for(name, given):
    assert make_planner(f"run_planners:{name}", short(), seed=7).given == given


def test_a_planner_that_is_made_already_is_copied_for_each_episode():
    made = make_planner("run_planners:READY", short())
    assert made is not READY
    assert made.speed_mps == 0.5
    assert make_planner("straight_on", short()).plan


def test_a_planner_may_ask_for_seed_boxes_and_robot_in_any_order():
    scenario = short()
    seed, boxes, robot, options = make_planner("run_planners:Everything", scenario, seed=7).given
    assert (seed, robot, options) == (7, NOVA_CARTER, {})
    np.testing.assert_array_equal(boxes, scenario.planner_boxes_odom_m)


def test_a_planner_may_ask_for_a_path_to_follow():
    scenario = short()
    task = scenario.robot
    (path,) = make_planner("run_planners:Follows", scenario).given
    np.testing.assert_array_equal(path, task.path_odom_m)
    np.testing.assert_array_equal(path[0], [task.start_x_m, task.start_y_m])
    np.testing.assert_array_equal(path[-1], [task.goal_x_m, task.goal_y_m])
    steps = np.diff(path, axis=0)
    length = np.hypot(*steps.T)
    assert 0.0 < length.max() <= 0.25 + 1e-9
    np.testing.assert_allclose(steps / length[:, None], np.tile([1.0, 0.0], (len(steps), 1)))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Asks", r"asks for the argument 'costmap' in \(robot, costmap\); it can have the robot"),
        ("Breaks", "cannot be made: RuntimeError: no licence"),
    ],
)
def test_a_planner_that_cannot_be_made_is_refused_before_anything_runs(name, message):
    with pytest.raises(SimError, match=message):
        plan_jobs([short()], ["blind"], [0], planners=[f"run_planners:{name}"])
