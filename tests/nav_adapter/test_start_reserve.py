"""The reserve for people who set off, however aware they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from nav_policies import policies, robots
from nav_scenes import ROBOT, crowds, finite, numbers, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, RobotProfile
from nav_adapter.policies import SpeedRules, StartReserve
from nav_adapter.proof import gap_at_standstill_m
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

RESERVE = StartReserve(human_acceleration_mps2=2.0, start_delay_s=0.0)
WALKER_MPS = 1.6


def with_reserve(policy: AwarenessPolicy, reserve: StartReserve | None) -> AwarenessPolicy:
    rules = policy.rules.model_copy(update={"start_reserve": reserve})
    return policy.model_copy(update={"rules": rules})


POLICY = AwarenessPolicy(rules=SpeedRules(start_reserve=RESERVE))
BARE = with_reserve(POLICY, None)


def limit_mps(
    track: PersonTrack, policy: AwarenessPolicy = POLICY, speed_mps: float = 0.0
) -> float:
    state = robot_at(speed_mps=speed_mps)
    return settled_update((track,), policy=policy, state=state).speed_limit_mps


def gap_m(separation_m: float, limit: float, start_delay_s: float = 0.0) -> float:
    """Return how far somebody who sets off now is away when the robot has stopped."""
    gap = gap_at_standstill_m(
        separation_m,
        limit,
        limit,
        WALKER_MPS,
        acceleration_mps2=ROBOT.max_acceleration_mps2,
        deceleration_mps2=ROBOT.max_deceleration_mps2,
        reaction_time_s=ROBOT.reaction_time_s,
        human_acceleration_mps2=RESERVE.human_acceleration_mps2,
        start_delay_s=start_delay_s,
    )
    return float(gap)


def test_nobody_ahead_who_sets_off_is_touched() -> None:
    """Watching people, from 0.2 m to 4 m: without the reserve many are touched, with it nobody."""
    touched = 0
    for ahead_m in np.linspace(0.9, 4.7, 60).tolist():
        track = person(position=(ahead_m, 0.0), awareness_lower=1.0)
        separation_m = ahead_m - float(ROBOT.footprint_m[:, 0].max()) - BODY_RADIUS_M
        limit, bare = limit_mps(track), limit_mps(track, BARE)
        assert limit <= bare
        if limit > 0.0:
            assert gap_m(separation_m, limit) >= -1e-9
            # It takes no more than it must.
            assert limit == pytest.approx(bare) or gap_m(separation_m, limit) < 1e-6
        touched += gap_m(separation_m, bare) < -1e-9
    assert touched > 20


@given(ahead=finite(1.5, 4.5), coming=finite(0.0, 1.2))
def test_somebody_who_comes_and_goes_on_speeding_up_is_not_touched(
    ahead: float, coming: float
) -> None:
    track = person(position=(ahead, 0.0), velocity=(-coming, 0.0), awareness_lower=1.0)
    limit = limit_mps(track)
    assert limit <= limit_mps(replace(track, velocity_odom_mps=np.zeros(2))) + 1e-12
    # From a stand to the present speed; the way until now is behind them.
    begun_s = coming / RESERVE.human_acceleration_mps2
    separation_m = ahead - float(ROBOT.footprint_m[:, 0].max()) - BODY_RADIUS_M
    already_m = coming**2 / (2.0 * RESERVE.human_acceleration_mps2)
    assert limit == 0.0 or gap_m(separation_m, limit, begun_s) + already_m >= -1e-9


@given(angle=finite(0.0, math.pi), away=finite(1.0, 4.0), speed=finite(0.1, 1.5))
def test_people_beside_the_course_limit_less_than_people_ahead(
    angle: float, away: float, speed: float
) -> None:
    def at(angle_rad: float) -> float:
        place = (away * math.cos(angle_rad), away * math.sin(angle_rad))
        track = person(position=place, awareness_lower=1.0)
        return limit_mps(track, speed_mps=speed)

    assert at(angle) >= at(0.0) - 0.35  # the footprint is longer than wide


def test_an_aware_person_still_lets_the_robot_pass_faster() -> None:
    beside = person(position=(0.0, 2.0), awareness_lower=1.0)
    unaware = replace(beside, awareness_lower=0.0)
    assert limit_mps(beside, speed_mps=1.0) > limit_mps(unaware, speed_mps=1.0) + 0.2


@settings(max_examples=60, deadline=None)
@given(policy=policies(), robot=robots(), tracks=crowds())
def test_it_only_lowers_the_limit_and_changes_no_obstacle(
    policy: AwarenessPolicy, robot: RobotProfile, tracks: tuple[PersonTrack, ...]
) -> None:
    bare = settled_update(tracks, policy=with_reserve(policy, None), robot=robot)
    kept = settled_update(tracks, policy=with_reserve(policy, RESERVE), robot=robot)
    assert kept.speed_limit_mps <= bare.speed_limit_mps
    assert numbers(kept)[5] == numbers(bare)[5]


@given(delay=finite(0.0, 0.5), more=finite(0.0, 0.5), ahead=finite(1.0, 4.0))
def test_a_later_notice_or_a_faster_start_never_raises_it(
    delay: float, more: float, ahead: float
) -> None:
    track = person(position=(ahead, 0.0), awareness_lower=1.0)

    def at(reserve: StartReserve) -> float:
        return limit_mps(track, with_reserve(POLICY, reserve))

    later = at(StartReserve(start_delay_s=delay + more))
    assert later <= at(StartReserve(start_delay_s=delay)) + 1e-12
    faster = at(StartReserve(human_acceleration_mps2=2.0 + more))
    assert faster <= at(StartReserve()) + 1e-12


@pytest.mark.parametrize("name", ["blind", "conservative", "balanced", "assertive"])
def test_every_preset_has_it(name: str) -> None:
    assert AwarenessPolicy.preset(name).rules.start_reserve is not None


@settings(max_examples=60, deadline=None)
@given(tracks=crowds())
def test_for_the_blind_it_changes_nothing(tracks: tuple[PersonTrack, ...]) -> None:
    """Speed and separation assumes more of everybody than the reserve."""
    blind = AwarenessPolicy.preset("blind")
    bare = settled_update(tracks, policy=with_reserve(blind, None))
    assert numbers(settled_update(tracks, policy=blind)) == numbers(bare)
