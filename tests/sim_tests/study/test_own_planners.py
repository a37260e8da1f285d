"""Planners of the user's own are called with what they ask for."""

import sys

import numpy as np
import pytest
from run_scenes import short

from sim_tests import NOVA_CARTER, SimError
from sim_tests.study.runs import make_planner, plan_jobs

SIGNATURES = """
class Base:
    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return 0.0, 0.0

class Bare(Base):
    pass

class Init(Base):
    def __init__(self):
        self.given = ()

class Robot(Base):
    def __init__(self, robot):
        self.given = (robot,)

class AnyName(Base):
    def __init__(self, vehicle, /, gain=2.0):
        self.given = (vehicle, gain)

class Tuned(Base):
    def __init__(self, gain=2.0, limits=None):
        self.given = (gain, limits)

class Seed(Base):
    def __init__(self, *, seed):
        self.given = (seed,)

class Everything(Base):
    def __init__(self, seed, static_boxes_odom_m, profile, **options):
        self.given = (seed, static_boxes_odom_m, profile, options)

class Follows(Base):
    def __init__(self, robot, *, reference_path_odom_m):
        self.given = (reference_path_odom_m,)

class HandsOn(Robot):
    def __init__(self, *args, **options):
        super().__init__(*args, **options)

class PositionalOnly(Base):
    def __init__(self, gain=2.0, seed=5, /):
        self.given = (gain, seed)

def function(seed=None):
    planner = Init()
    planner.given = (seed,)
    return planner

class Asks(Base):
    def __init__(self, robot, costmap):
        pass

class Breaks(Base):
    def __init__(self):
        raise RuntimeError("no licence")
"""


@pytest.fixture(scope="module")
def signatures(tmp_path_factory):
    """Return the module name of planners with all kinds of signatures."""
    folder = tmp_path_factory.mktemp("planners")
    (folder / "planner_signatures.py").write_text(SIGNATURES)
    sys.path.insert(0, str(folder))
    yield "planner_signatures"
    sys.path.remove(str(folder))


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("Init", ()),
        ("Robot", (NOVA_CARTER,)),
        ("AnyName", (NOVA_CARTER, 2.0)),
        ("Tuned", (2.0, None)),
        ("Seed", (7,)),
        ("HandsOn", (NOVA_CARTER,)),
        ("PositionalOnly", (2.0, 5)),
        ("function", (7,)),
    ],
)
def test_a_planner_is_called_with_what_its_signature_asks_for(signatures, name, given):
    assert make_planner(f"{signatures}:{name}", short().median(), seed=7).given == given


def test_a_planner_without_a_constructor_is_made(signatures):
    assert make_planner(f"{signatures}:Bare", short().median()).plan(None, None, None, 0.1)


def test_a_planner_may_ask_for_seed_boxes_and_robot_in_any_order(signatures):
    scenario = short().median()
    seed, boxes, robot, options = make_planner(f"{signatures}:Everything", scenario, seed=7).given
    assert (seed, robot, options) == (7, NOVA_CARTER, {})
    np.testing.assert_array_equal(boxes, scenario.planner_boxes_odom_m)


def test_a_planner_may_ask_for_a_path_to_follow(signatures):
    scenario = short().median()
    task = scenario.robot
    (path,) = make_planner(f"{signatures}:Follows", scenario).given
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
def test_a_planner_that_cannot_be_made_is_refused_before_anything_runs(signatures, name, message):
    with pytest.raises(SimError, match=message):
        plan_jobs([short()], ["blind"], [0], planners=[f"{signatures}:{name}"])
