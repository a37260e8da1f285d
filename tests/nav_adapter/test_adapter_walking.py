"""People who walk: whom the bound on human acceleration holds for, and what it is worth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_policies import policies, robots, walking_rules
from nav_scenes import ROBOT, crowds, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, RobotProfile
from nav_adapter.policies import SpeedRules, StartReserve, WalkingPeople
from tracking import PersonTrack

RULE = WalkingPeople(human_acceleration_mps2=2.0, turn_delay_s=0.25, velocity_sigmas=2.0)
BLIND = AwarenessPolicy.preset("blind").model_copy(update={"rules": SpeedRules()})
PLACE = (2.0, 0.0)
#: Straight away from the robot.
LEAVING = person(position=PLACE, velocity=(1.3, 0.0))


def with_rule(
    policy: AwarenessPolicy, rule: WalkingPeople | None = RULE, reserve: StartReserve | None = None
) -> AwarenessPolicy:
    rules = policy.rules.model_copy(update={"walking": rule, "start_reserve": reserve})
    return policy.model_copy(update={"rules": rules})


WALKING = with_rule(BLIND)


def limit_mps(track: PersonTrack, policy: AwarenessPolicy = WALKING) -> float:
    return settled_update((track,), policy=policy).speed_limit_mps


def test_somebody_who_walks_away_must_first_turn_round() -> None:
    """1.3 m/s away take 0.65 s at 2 m/s², of which 0.25 s may be over: no way until it brakes."""
    found = limit_mps(LEAVING)
    gap_m = 2.0 - np.hypot(0.3625, 0.25) - 0.30 - 0.10 - 0.0625
    braking_s = found / 1.0
    spare_m = gap_m - (0.3 * found + 0.5 * found**2) - 0.5 * 2.0 * braking_s**2
    assert braking_s < 0.8  # the person is not yet at 1.6 m/s
    assert spare_m == pytest.approx(0.0, abs=1e-9)
    assert found > limit_mps(LEAVING, BLIND) + 0.2


@pytest.mark.parametrize("name", ["blind", "conservative", "balanced", "assertive"])
def test_the_presets_have_the_rule(name: str) -> None:
    assert AwarenessPolicy.preset(name).rules.walking == WalkingPeople()


@pytest.mark.parametrize(
    "track",
    [
        replace(LEAVING, status="tentative"),
        replace(LEAVING, status="coasting"),
        replace(LEAVING, time_since_seen_s=0.3),
        replace(LEAVING, velocity_odom_mps=np.array([-1.3, 0.0])),
        replace(LEAVING, covariance_odom=np.diag([0.0, 0.0, 1.0, 1.0])),
    ],
    ids=["tentative", "coasting", "unseen", "comes nearer", "uncertain"],
)
def test_for_nobody_else_anything_changes(track: PersonTrack) -> None:
    assert limit_mps(track) == limit_mps(track, BLIND)


def test_nobody_turns_at_first_sight() -> None:
    adapters = NavAdapter(WALKING, ROBOT), NavAdapter(BLIND, ROBOT)
    limits = []
    for stamp_s in (0.0, 0.1, 0.2, 0.3):
        place = np.array([2.0 + 1.3 * stamp_s, 0.0])
        track = replace(LEAVING, stamp_s=stamp_s, position_odom_m=place)
        here = robot_at(stamp_s)
        limits.append([each.update([track], here, stamp_s).speed_limit_mps for each in adapters])
    gained = [with_ - without for with_, without in limits]
    assert gained[:2] == [0.0, 0.0]
    assert min(gained[2:]) > 0.2


@pytest.mark.parametrize("unseen_s", [0.05, 0.1, 0.2])
def test_time_without_a_look_counts_as_time_in_which_a_turn_was_missed(unseen_s: float) -> None:
    later = with_rule(BLIND, RULE.model_copy(update={"turn_delay_s": 0.25 + unseen_s}))
    predicted = replace(LEAVING, time_since_seen_s=unseen_s)
    assert limit_mps(predicted) == pytest.approx(limit_mps(LEAVING, later), abs=1e-12)


def test_uncertain_velocities_count_as_coming_nearer() -> None:
    """Two standard deviations of 0.1 m/s in any direction are 0.2 m/s."""
    uncertain = replace(LEAVING, covariance_odom=np.diag([0.0, 0.0, 0.0, 0.01]))
    slower = replace(LEAVING, velocity_odom_mps=np.array([1.1, 0.0]))
    assert limit_mps(uncertain) == pytest.approx(limit_mps(slower), abs=1e-12)


def test_the_bound_is_of_the_base_and_not_of_a_corner() -> None:
    """A person who leaves the base of a long robot may come at the corner beside them."""
    long = replace(ROBOT, footprint_m=ROBOT.footprint_m * [6.0, 1.0])
    track = person(position=(1.5, 1.2), velocity=(1.2, -0.5))
    nearer = replace(track, position_odom_m=np.array([1.7, 1.1]))
    gaps = [abs(each.position_odom_m[1]) for each in (track, nearer)]
    assert gaps[0] > gaps[1]
    assert np.linalg.norm(nearer.position_odom_m) > np.linalg.norm(track.position_odom_m)
    found = [
        settled_update((track,), policy=policy, robot=long).speed_limit_mps
        for policy in (WALKING, BLIND)
    ]
    assert found[0] == found[1]


def test_the_start_reserve_counts_the_time_to_turn_round_too() -> None:
    aware = replace(LEAVING, awareness_lower=1.0)
    assertive = AwarenessPolicy.preset("assertive").model_copy(update={"rules": SpeedRules()})
    reserve = StartReserve()
    with_, without = (
        settled_update((aware,), policy=with_rule(assertive, rule, reserve))
        for rule in (RULE, None)
    )
    assert without.limited_by == "track 1: start reserve"
    assert with_.speed_limit_mps > without.speed_limit_mps + 0.05
    at_once = RULE.model_copy(update={"turn_delay_s": 0.65})
    late = settled_update((aware,), policy=with_rule(assertive, at_once, reserve))
    assert late.speed_limit_mps == without.speed_limit_mps


@settings(max_examples=60)
@given(policy=policies(), robot=robots(), people=crowds(), rule=walking_rules(), data=st.data())
def test_the_rule_never_lowers_a_limit(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    people: tuple[PersonTrack, ...],
    rule: WalkingPeople,
    data: st.DataObject,
) -> None:
    reserve = data.draw(st.sampled_from([None, StartReserve()]))
    state = replace(robot_at(), speed_mps=data.draw(st.sampled_from([0.0, 0.5])))
    limits = [
        settled_update(people, policy=with_rule(policy, each, reserve), robot=robot, state=state)
        for each in (None, rule)
    ]
    assert limits[1].speed_limit_mps >= limits[0].speed_limit_mps - 1e-12
    assert limits[1].braking_suffices or not limits[0].braking_suffices
