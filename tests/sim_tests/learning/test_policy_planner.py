"""Learned policies as planners, which need no Gymnasium."""

from __future__ import annotations

import sys
from importlib import import_module

import numpy as np
import pytest

from awarenav.errors import MissingExtraError
from nav_adapter import AwarenessPolicy, NavAdapter, RobotState
from sim_tests import SimError, run_crossing
from sim_tests.actors.robot import NOVA_CARTER
from sim_tests.crossing import StraightOn
from sim_tests.learning import ObservationEncoder, PolicyPlanner
from sim_tests.scenario import Scenario


def test_a_policy_that_drives_straight_is_a_planner_that_drives_straight() -> None:
    short = Scenario.shipped("crossing_from_left").draw(0)
    short = short.model_copy(update={"duration_s": 1.0})
    drives = [
        run_crossing(short, policy="balanced", planner=planner)
        for planner in (PolicyPlanner(lambda observation: [0.5, 0.0]), StraightOn(0.75))
    ]
    by_policy, by_speed = (
        [(each.robot_state.position_odom_m.tolist(), each.command) for each in drive.frames]
        for drive in drives
    )
    assert by_policy == by_speed
    with pytest.raises(SimError, match="policy must be a function"):
        PolicyPlanner("straight")  # type: ignore[arg-type]


def test_an_observation_turns_with_the_robot_and_sees_the_boxes() -> None:
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), NOVA_CARTER)
    state = RobotState(0.0, [1.0, 2.0], np.pi / 2, 0.5, 0.1)
    constraints = adapter.update((), state, 0.0, perception_stamp_s=0.0)
    encoder = ObservationEncoder(2, 4, [[0.0, 5.0, 2.0, 6.0], [3.0, 1.0, 4.0, 3.0]])
    observation = encoder.encode(state, np.array([1.0, 6.0]), constraints)
    assert observation["goal"] == pytest.approx([4.0, 0.0], abs=1e-6)
    # Ahead is odom y; the second box is to the right, the fourth of four rays.
    assert observation["scan"] == pytest.approx([3.0, 10.0, 10.0, 2.0])
    assert observation["robot"][:3] == pytest.approx([0.5, 0.1, constraints.speed_limit_mps])
    assert not observation["mask"].any()
    inside = RobotState(0.0, [1.0, 5.5], 0.0, 0.0, 0.0)
    assert (encoder.encode(inside, np.zeros(2), constraints)["scan"] == 0.0).all()
    with pytest.raises(SimError, match="people_slots must be at least 1"):
        ObservationEncoder(0)


def test_without_gymnasium_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "sim_tests.learning._environment", raising=False)
    with pytest.raises(MissingExtraError, match=r"needs Gymnasium.*extra 'gym'.*pip install"):
        import_module("sim_tests.learning._environment")
