"""People who walk and turn to the robot: nobody is reached, by motion in small steps."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from nav_scenes import person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.policies import SpeedRules, WalkingPeople
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

RADIUS_M, CLEARANCE_M, DT_S = 0.4, 0.1, 2e-3
ANGLES = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
# Nearly round, so that both bounds of the limit are the same.
ROBOT = RobotProfile(
    footprint_m=RADIUS_M * np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1),
    max_speed_mps=3.0,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=1.0,
    reaction_time_s=0.3,
)
RULE = WalkingPeople(human_acceleration_mps2=2.0, turn_delay_s=0.25, velocity_sigmas=0.0)


class Encounters(NamedTuple):
    """N people about a robot that drives along x, as the tracker shows them."""

    places_m: FloatArray
    velocities_mps: FloatArray
    limits_mps: FloatArray


def with_rule(rule: WalkingPeople | None, name: str = "blind") -> AwarenessPolicy:
    policy = AwarenessPolicy.preset(name)
    rules = SpeedRules(walking=rule)
    return policy.model_copy(update={"rules": rules})


def encounters(rule: WalkingPeople | None, count: int = 400) -> Encounters:
    """Return people ahead of the robot who walk anywhere, with the limit for each of them."""
    rng = np.random.default_rng(7)
    bearing = rng.uniform(-0.5, 0.5, count) * np.pi
    away_m = RADIUS_M + BODY_RADIUS_M + rng.uniform(0.15, 3.5, count)
    places = away_m[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
    # Half of them away from the robot, within 60°.
    course = np.where(
        np.arange(count) % 2, bearing + rng.uniform(-1.0, 1.0, count), rng.uniform(-4, 4, count)
    )
    speed = rng.uniform(0.0, 1.6, count)
    velocities = speed[:, None] * np.stack([np.cos(course), np.sin(course)], axis=1)
    policy, state = with_rule(rule), replace(robot_at(), speed_mps=0.5)
    limits = [
        settled_update(
            [person(position=place, velocity=velocity)], policy=policy, robot=ROBOT, state=state
        ).speed_limit_mps
        for place, velocity in zip(places, velocities, strict=True)
    ]
    return Encounters(places, velocities, np.array(limits))


def least_gap_m(met: Encounters, acceleration_mps2: float, delay_s: float) -> FloatArray:
    """Return the least gap (N,) to a robot that moves, people speeding up towards it.

    They began ``delay_s`` before the tracker's stamp, which shows them as if they had walked on.
    The robot keeps its speed for the reaction time, and then brakes.
    """
    places = met.places_m - delay_s * met.velocities_mps
    velocities, robot_x = met.velocities_mps.copy(), np.zeros(len(places))
    speed, least, time_s = met.limits_mps.copy(), np.full(len(places), np.inf), -delay_s
    while (speed > 0.0).any():
        base = np.stack([robot_x, np.zeros_like(robot_x)], axis=1)
        offset = base - places
        distance = np.linalg.norm(offset, axis=1)
        if time_s >= 0.0:
            gap = distance - RADIUS_M - BODY_RADIUS_M
            least = np.where(speed > 0.0, np.minimum(least, gap), least)
            robot_x = robot_x + speed * DT_S
            if time_s >= ROBOT.reaction_time_s:
                speed = np.maximum(speed - ROBOT.max_deceleration_mps2 * DT_S, 0.0)
        velocities = velocities + DT_S * acceleration_mps2 * offset / distance[:, None]
        pace = np.maximum(np.linalg.norm(velocities, axis=1), 1e-9)
        velocities *= np.minimum(1.6 / pace, 1.0)[:, None]
        places = places + DT_S * velocities
        time_s += DT_S
    return least


@pytest.fixture(scope="module")
def met() -> Encounters:
    return encounters(RULE)


@pytest.fixture(scope="module")
def without() -> Encounters:
    return encounters(None)


def test_nobody_who_turns_to_the_robot_comes_nearer_than_the_clearance(
    met: Encounters, without: Encounters
) -> None:
    """For the others the limit is the old one, with which the way in the delay is not counted."""
    raised = met.limits_mps > without.limits_mps
    gaps = least_gap_m(met, 2.0, 0.25)[raised]
    assert len(gaps) > 250
    assert gaps.min() > CLEARANCE_M - 0.005  # small steps
    # Some come as near as is allowed, so the bound is not idle.
    assert gaps.min() < CLEARANCE_M + 0.005


def test_the_rule_is_worth_most_beside_people_who_walk_away(
    met: Encounters, without: Encounters
) -> None:
    assert (met.limits_mps >= without.limits_mps).all()
    away_m = np.linalg.norm(met.places_m, axis=1)
    leaving_mps = (met.places_m * met.velocities_mps).sum(axis=1) / away_m
    gained_mps = (met.limits_mps - without.limits_mps)[without.limits_mps < 1.5]
    leaving_mps = leaving_mps[without.limits_mps < 1.5]
    assert gained_mps[leaving_mps > 1.0].mean() > 0.3
    assert gained_mps[abs(leaving_mps) < 0.5].mean() < 0.15
    assert gained_mps[leaving_mps < -1.0].max() == 0.0


@pytest.mark.parametrize(
    ("acceleration_mps2", "delay_s"), [(4.0, 0.25), (2.0, 0.6)], ids=["harder", "later"]
)
def test_people_who_turn_harder_or_are_noticed_later_do(
    met: Encounters, acceleration_mps2: float, delay_s: float
) -> None:
    """So the bounds are what the rule stands on."""
    gaps = least_gap_m(met, acceleration_mps2, delay_s)
    assert gaps[met.limits_mps > 0.0].min() < CLEARANCE_M - 0.1
