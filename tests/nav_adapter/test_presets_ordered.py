"""The presets: their order at every instant, and what tells them apart; circles to pass by."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import Walk, driven, histories, robots
from nav_scenes import ROBOT, finite, person, policy_radius_m, robot_at, rotation, settled_update

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.limit import passing_radius_m
from nav_adapter.policies import ReachRules
from perception.anthropometry import BODY_RADIUS_M

PRESETS = ("blind", "conservative", "balanced", "assertive")
#: The first of each pair is at least as careful at every instant.
ORDERED = (
    ("conservative", "balanced"),
    ("balanced", "assertive"),
    ("conservative", "assertive"),
    ("blind", "balanced"),
    ("blind", "assertive"),
)
ROUNDING = 1e-9


@settings(max_examples=20)
@given(robot=st.just(ROBOT) | robots(), walk=histories(12))
def test_presets_are_ordered_at_every_instant(robot: RobotProfile, walk: Walk) -> None:
    results = {name: driven(AwarenessPolicy.preset(name), robot, walk) for name in PRESETS}
    for careful, bold in ORDERED:
        for a, b in zip(results[careful], results[bold], strict=True):
            assert a.speed_limit_mps <= b.speed_limit_mps + ROUNDING, (careful, bold)
            radii = zip(a.obstacles, b.obstacles, strict=True)
            assert all(wide.radius_m >= narrow.radius_m - ROUNDING for wide, narrow in radii), (
                careful,
                bold,
            )


def limits(name: str) -> dict[str, float]:
    """Return the limits of a robot at 0.8 m/s where presets matter: near people ahead or beside."""
    places = {"ahead": (2.0, 0.0), "beside": (1.2, 0.9)}
    people = {
        "unaware": {"awareness_lower": 0.0},
        "half aware": {"awareness_lower": 0.4},
        "aware": {"awareness_lower": 1.0},
    }
    policy, found = AwarenessPolicy.preset(name), {}
    for place, position in places.items():
        for who, alpha in people.items():
            track = person(position=position, **alpha)
            state = robot_at(speed_mps=0.8)
            limit = settled_update((track,), policy=policy, state=state).speed_limit_mps
            found[f"{who} {place}"] = limit
        noticed = replace(person(position=position), noticed=0.9)
        result = settled_update((noticed,), policy=policy, state=robot_at(speed_mps=0.8))
        found[f"noticed {place}"] = result.speed_limit_mps
    return found


@pytest.mark.parametrize(("one", "other"), list(combinations(PRESETS, 2)))
def test_each_pair_of_presets_differs_where_it_matters(one: str, other: str) -> None:
    """By at least 5 % of the limit, for somebody near the robot's way."""
    a, b = limits(one), limits(other)
    apart = {key: abs(a[key] - b[key]) / max(a[key], b[key]) for key in a}
    assert max(apart.values()) >= 0.05, apart


def test_awareness_is_worth_more_than_a_choice_of_preset() -> None:
    """Beside somebody who has noticed the robot ``balanced`` drives as fast as ``blind`` alone."""
    blind, balanced = limits("blind"), limits("balanced")
    for who in ("aware", "noticed"):
        assert balanced[f"{who} beside"] > 1.3 * blind[f"{who} beside"]
    for place in ("ahead", "beside"):
        assert balanced[f"unaware {place}"] == pytest.approx(blind[f"unaware {place}"])
    assert np.isclose(
        limits("conservative")["noticed beside"], limits("conservative")["unaware beside"]
    )


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
def test_beside_the_circle_of_anybody_the_robot_may_drive(name, alpha, along_m, course_rad, side):
    """For every awareness, course and place along the edge."""
    policy = AwarenessPolicy.preset(name)
    assert passing_mps(policy, alpha, along_m, course_rad, side) >= PASSING_MPS - 0.02


def test_a_robot_that_keeps_its_course_may_pass_somebody_aware_within_the_clearance() -> None:
    """Nobody moves and nobody turns: the way beside the body is free."""
    straight = ReachRules(turn_deg=0.0)
    radius_m = passing_radius_m(0.0, straight, 0.10, ROBOT)
    assert FLOOR_M <= radius_m <= FLOOR_M + 0.01
