"""Circle and limit agree: a robot that keeps to the edge of a circle may drive on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import reach_rules, robots
from nav_scenes import (
    ROBOT,
    finite,
    person,
    policy_radius_m,
    robot_at,
    rotation,
    settled_update,
)

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.limit import passing_radius_m
from nav_adapter.policies import ReachRules
from perception.anthropometry import BODY_RADIUS_M

PRESETS = ("blind", "conservative", "balanced", "assertive")
PASSING_MPS = 0.3
FLOOR_M = BODY_RADIUS_M + 0.10


def passing_mps(
    policy: AwarenessPolicy, alpha: float, along_m: float, course_rad: float, side: float
) -> float:
    """Return the limit of a robot at 0.3 m/s that goes straight along a circle's edge.

    The person stands ``along_m`` ahead of the base, and the robot's side touches the circle.
    """
    beside_m = policy_radius_m(policy, alpha) + 0.25
    position = rotation(course_rad) @ np.array([along_m, side * beside_m])
    state = robot_at(heading_rad=course_rad, speed_mps=PASSING_MPS)
    track = person(position=position.tolist(), awareness_lower=alpha)
    return settled_update([track], policy=policy, state=state).speed_limit_mps


@settings(max_examples=30)
@given(
    name=st.sampled_from(PRESETS),
    alpha=finite(0.0, 1.0),
    along_m=finite(-1.5, 3.0),
    course_rad=finite(-math.pi, math.pi),
    side=st.sampled_from([1.0, -1.0]),
)
def test_beside_the_circle_of_anybody_the_robot_may_drive(
    name: str, alpha: float, along_m: float, course_rad: float, side: float
) -> None:
    """For every awareness, course and place along the edge."""
    policy = AwarenessPolicy.preset(name)
    assert passing_mps(policy, alpha, along_m, course_rad, side) >= PASSING_MPS - 0.02


@settings(max_examples=25)
@given(
    robot=robots(),
    rules=reach_rules(),
    human_mps=finite(0.0, 1.8),
    clearance_m=finite(0.1, 0.4),
    more=finite(0.0, 0.5),
)
def test_the_radius_is_the_smallest_and_grows_with_the_persons_speed(
    robot: RobotProfile, rules: ReachRules, human_mps: float, clearance_m: float, more: float
) -> None:
    radius_m = passing_radius_m(human_mps, rules, clearance_m, robot)
    assert radius_m >= BODY_RADIUS_M + clearance_m
    rounding = 0.01 * radius_m
    assert passing_radius_m(human_mps + more, rules, clearance_m, robot) >= radius_m - rounding
    assert passing_radius_m(human_mps, rules, clearance_m + more, robot) >= radius_m - rounding


def test_without_reach_it_is_body_and_clearance() -> None:
    assert passing_radius_m(1.5, None, 0.25, ROBOT) == pytest.approx(BODY_RADIUS_M + 0.25)


def test_a_robot_that_keeps_its_course_may_pass_somebody_aware_within_the_clearance() -> None:
    """Nobody moves and nobody turns: the way beside the body is free."""
    straight = ReachRules(turn_deg=0.0)
    radius_m = passing_radius_m(0.0, straight, 0.10, ROBOT)
    assert FLOOR_M <= radius_m <= FLOOR_M + 0.01
