"""Arguments and settings that the reference planner refuses, with their messages."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from nav_adapter import NavConstraints, RobotProfile, RobotState
from sim_tests import SimError
from sim_tests.crossing.planner import PlannerConfig, SamplingPlanner

OUTLINE_M = np.array([[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]])
ROBOT = RobotProfile(OUTLINE_M, 1.5, 1.0, 1.0, 0.3)
AT_REST = RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0)
NO_ONE = NavConstraints(0.0, (), 1.5, "test", False)


@pytest.mark.parametrize("goal", [(math.nan, 0.0), (1.0, math.inf), (1.0, 2.0, 3.0), "home"])
def test_an_unusable_goal_is_refused_by_name(goal: object) -> None:
    with pytest.raises(SimError, match="goal_odom_m"):
        SamplingPlanner(ROBOT).plan(AT_REST, goal, NO_ONE, 0.05)  # type: ignore[arg-type]


@pytest.mark.parametrize("dt_s", [0.0, -0.05, math.nan, math.inf])
def test_an_unusable_tick_is_refused_by_name(dt_s: float) -> None:
    with pytest.raises(SimError, match="dt_s"):
        SamplingPlanner(ROBOT).plan(AT_REST, (8.0, 0.0), NO_ONE, dt_s)


@pytest.mark.parametrize("boxes", [[[0, 0, 0, 1]], [[0, 0, 1, math.nan]], [[0, 0, 1]]])
def test_unusable_boxes_are_refused_by_name(boxes: list[list[float]]) -> None:
    with pytest.raises(SimError, match="static_boxes_odom_m"):
        SamplingPlanner(ROBOT, boxes)


def test_weights_with_which_a_robot_never_turns_to_its_goal_are_refused() -> None:
    with pytest.raises(ValidationError, match="heading_weight"):
        PlannerConfig(heading_weight=0.05)


def test_the_config_survives_yaml_and_names_unknown_keys(tmp_path: Path) -> None:
    config = PlannerConfig(horizon_s=2.5, speed_samples=9)
    config.to_yaml(tmp_path / "planner.yaml")
    assert PlannerConfig.from_yaml(tmp_path / "planner.yaml") == config
    with pytest.raises(ValidationError, match="did you mean 'horizon_s'"):
        PlannerConfig.model_validate({"horizont_s": 2.0})
