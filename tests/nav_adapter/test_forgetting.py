"""Awareness that lasts for a while: the limit knows when it ends, and falls as the robot brakes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter
from nav_adapter.course import course_of
from nav_adapter.exporters import speed_limit_at
from nav_adapter.limit import FINEST, limit_mps, step_of_s
from nav_adapter.reach import Reach
from nav_adapter.rigid import Motion
from tracking import PersonTrack
from tracking.people import AVERTED_LEFT_S

POLICY = AwarenessPolicy.preset("balanced")
AWARE_MPS, UNAWARE_MPS = (POLICY.speed.human_speed_mps(each) for each in (1.0, 0.0))
CYCLE_S = 0.05
BRAKING_MPS2 = ROBOT.max_deceleration_mps2
# A limit lies below the exact one by the last, finest step of time.
SLACK_MPS = FINEST * BRAKING_MPS2 * step_of_s(ROBOT.max_speed_mps, BRAKING_MPS2) + 0.005
LEFT_S = st.floats(0.0, 3.5)


def knowing(x: float, y: float, left_s: float, *velocity: float, top: float = AWARE_MPS) -> Reach:
    """Return somebody who knows of the robot for so long, at a place before its base."""
    u, v = velocity or (0.0, 0.0)
    return Reach(
        *(x, y, u, v, top, POLICY.reach.time_constant_s, POLICY.reach.delay_s),
        margin_m=POLICY.margins.floor_m,
        within_m=POLICY.margins.within_m(top, UNAWARE_MPS),
        variances=(0.003, 0.0, 0.0),
        until_s=left_s,
        later_mps=UNAWARE_MPS,
    )


def limit_of(reach: Reach, turn_rad: float = 0.0) -> float:
    """Return the limit of the reach, and of walking on, for a robot at the origin."""
    motion = Motion(0.0, 0.0, 0.0, 1.0)
    lowest = min(limit_mps(reach, course_of(ROBOT, motion, turn_rad)), ROBOT.max_speed_mps)
    if reach.may_walk_on:
        lowest = min(lowest, limit_mps(reach.walking_on(), course_of(ROBOT, motion, turn_rad)))
    return lowest


@settings(max_examples=100, deadline=None)
@given(
    place=st.tuples(st.floats(0.3, 5.0), st.floats(-2.0, 2.0)),
    walk=st.tuples(st.sampled_from([0.0, 0.0, 0.5, 1.0, 1.4]), st.floats(-math.pi, math.pi)),
    left_s=LEFT_S,
    share=st.one_of(st.just(1.0), st.floats(0.2, 1.0)),
    turn_rad=st.sampled_from([0.0, 0.52]),
)
def test_who_keeps_to_their_motion_never_makes_a_robot_brake_harder_than_it_can(
    place, walk, left_s, share, turn_rad
):
    """A robot at its limit, or at a share of it, brakes in time while memory runs out."""
    velocity = walk[0] * math.cos(walk[1]), walk[0] * math.sin(walk[1])
    now = knowing(*place, left_s, *velocity)
    before = limit_of(now, turn_rad)
    later = now._replace(
        x_m=now.x_m + (velocity[0] - share * before) * CYCLE_S,
        y_m=now.y_m + velocity[1] * CYCLE_S,
        until_s=max(left_s - CYCLE_S, 0.0),
    )
    # Who comes in from beside may stop in the way later than at once.
    if walk[0] > 0.0 and min(now.x_m, later.x_m) < 0.6:
        return
    assert limit_of(later, turn_rad) >= share * before - BRAKING_MPS2 * CYCLE_S - SLACK_MPS


@settings(max_examples=50, deadline=None)
@given(
    place=st.tuples(st.floats(-1.0, 5.0), st.floats(-2.0, 2.0)),
    velocity=st.tuples(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4)),
    left_s=st.tuples(LEFT_S, LEFT_S),
)
def test_more_memory_is_never_slower_and_none_is_no_awareness(place, velocity, left_s) -> None:
    some, more = (limit_of(knowing(*place, each, *velocity)) for each in sorted(left_s))
    none = limit_of(knowing(*place, 0.0, *velocity).at_least(UNAWARE_MPS))
    for_good = limit_of(knowing(*place, math.inf, *velocity))
    course = course_of(ROBOT, Motion(0.0, 0.0, 0.0, 1.0), 0.0)
    forgotten = knowing(*place, 0.0, *velocity)
    assert limit_mps(forgotten, course) == pytest.approx(
        limit_mps(forgotten.at_least(UNAWARE_MPS), course), abs=1e-9
    )
    assert none - SLACK_MPS <= some <= more + SLACK_MPS <= for_good + 2.0 * SLACK_MPS


def known(left_s: float = math.inf, departed_mps: float = 0.0) -> PersonTrack:
    """Return a track of somebody ahead who looks at the robot."""
    ahead = person(position=(2.2, 0.3), awareness_lower=0.9)
    return replace(ahead, aware_for_s=left_s, departed_mps=departed_mps)


def limit_with(track: PersonTrack) -> float:
    return settled_update([track], policy=POLICY).speed_limit_mps


def test_an_update_takes_the_memory_of_the_track() -> None:
    unaware = limit_with(replace(known(), awareness_lower=0.0))
    limits = [limit_with(known(each)) for each in (0.0, 0.3, 0.6, 1.0, 1.5, 3.0, math.inf)]
    assert limits == sorted(limits)
    assert limits[0] == pytest.approx(unaware, abs=1e-9)
    assert limits[1] > unaware
    # More than a face that looks away leaves counts where nothing is remembered, and alone there.
    assert limits[-1] > limits[-2] == limits[-3] > unaware + 0.3


def test_whoever_departs_from_their_motion_is_as_fast_as_that() -> None:
    limits = [limit_with(known(departed_mps=each)) for each in (0.0, 0.2, 0.4, 0.8, 1.5, 4.0)]
    assert limits == sorted(limits, reverse=True)
    assert limits[0] == limits[1] > limits[2] > limits[3]
    stranger = replace(known(), awareness_lower=0.0)
    assert limits[-1] == pytest.approx(limit_with(stranger), abs=1e-9)
    assert limit_with(replace(stranger, departed_mps=4.0)) == limit_with(stranger)


@pytest.mark.parametrize("left_s", [0.4, 1.0, 2.0])
def test_limits_ahead_know_when_awareness_ends(left_s: float) -> None:
    now = settled_update([known(left_s)], policy=POLICY)
    ahead_s = [0.0, 0.3, 0.8, 2.5]
    stranger = limit_with(replace(known(), awareness_lower=0.0))
    unaware = speed_limit_at(now, np.zeros((1, 2, 2)), [[0.0] * 2], dt_s=0.1, aware_for_s=0.0)
    assert unaware[0] == pytest.approx(stranger, abs=0.02)
    here, speeds = np.zeros((1, 1, 2)), [[robot_at(0.0).speed_mps]]
    for each in ahead_s:
        field = speed_limit_at(now, here, [[0.0]], first_s=each, dt_s=0.1, speeds_mps=speeds)
        then = limit_with(known(max(left_s - each, 0.0)))
        assert then - 0.02 <= field[0, 0] <= then + 1e-3


@settings(max_examples=30, deadline=None)
@given(
    place=st.tuples(st.floats(1.0, 5.0), st.floats(-2.0, 2.0)),
    left_s=st.floats(AVERTED_LEFT_S, 3.5),
    braking_mps2=st.sampled_from([0.5, 1.0, 2.0]),
    share=st.one_of(st.just(1.0), st.floats(0.2, 1.0)),
    lower=st.floats(0.6, 1.0),
)
def test_a_face_that_looks_away_makes_no_robot_brake_harder_than_it_can(
    place, left_s, braking_mps2, share, lower
):
    """Also one that takes longer to stop than a face that looks away leaves."""
    robot = replace(ROBOT, max_deceleration_mps2=braking_mps2)
    adapter = NavAdapter(POLICY, robot)

    def at(now_s: float, driven_m: float, knows_s: float) -> float:
        shown = person(now_s, position=place, awareness_lower=lower)
        track = replace(shown, noticed=0.9, aware_for_s=knows_s)
        state = robot_at(now_s, position=(driven_m, 0.0))
        return adapter.update([track], state, now_s).speed_limit_mps

    for count in range(6):
        before = at(CYCLE_S * count, 0.0, left_s)
    after = at(6 * CYCLE_S, share * before * CYCLE_S, min(left_s - CYCLE_S, AVERTED_LEFT_S))
    step_mps = FINEST * braking_mps2 * step_of_s(robot.max_speed_mps, braking_mps2) + 0.005
    assert after >= share * before - braking_mps2 * CYCLE_S - step_mps


@settings(max_examples=40, deadline=None)
@given(
    left_s=st.tuples(LEFT_S, LEFT_S),
    departed_mps=st.tuples(st.floats(0.0, 1.5), st.floats(0.0, 1.5)),
    later_s=st.floats(0.0, 0.2),
    place=st.tuples(st.floats(1.0, 3.0), st.floats(-1.0, 1.0)),
)
def test_a_track_without_a_newer_frame_knows_nothing_better(left_s, departed_mps, later_s, place):
    """Whatever it says of memory and motion: no frame shows either."""
    adapter = NavAdapter(POLICY, ROBOT)

    def at(stamp_s: float, index: int, unseen_s: float = 0.0) -> PersonTrack:
        shown = person(stamp_s, position=place, awareness_lower=0.9, unseen_s=unseen_s)
        return replace(shown, aware_for_s=left_s[index], departed_mps=departed_mps[index])

    for count in range(5):
        now_s = 0.1 * count
        before = adapter.update([at(now_s, 0)], robot_at(now_s), now_s)
    then_s = now_s + later_s
    after = adapter.update([at(then_s, 1, unseen_s=later_s)], robot_at(then_s), then_s)
    assert after.speed_limit_mps <= before.speed_limit_mps + 1e-6


@settings(max_examples=12, deadline=None)
@given(
    ahead_m=st.floats(8.0, 12.0),
    beside_m=st.floats(-1.6, 1.6),
    walking_mps=st.floats(0.4, 1.5),
    braking_mps2=st.sampled_from([0.6, 1.0, 1.5]),
    knows_s=st.one_of(st.just(math.inf), st.floats(1.5, 5.0)),
)
def test_a_robot_at_its_limit_brakes_in_time_beside_people_who_walk_past(
    ahead_m, beside_m, walking_mps, braking_mps2, knows_s
):
    """Whether they go on looking or their look ends on the way."""
    robot = replace(ROBOT, max_deceleration_mps2=braking_mps2)
    adapter = NavAdapter(POLICY, robot)
    driven_m = speed_mps = 0.0
    for step in range(200):
        now_s = step * CYCLE_S
        place_m = ahead_m - walking_mps * now_s
        if place_m < driven_m + 0.4:
            break
        left_s = min(max(knows_s - now_s, 0.0), 3.0)
        shown = person(now_s, position=(place_m, beside_m), velocity=(-walking_mps, 0.0))
        looks = 0.9 if left_s > 0.0 else 0.0
        track = replace(shown, awareness_lower=looks, noticed=looks, aware_for_s=left_s)
        state = robot_at(now_s, speed_mps=speed_mps, position=(driven_m, 0.0))
        limit_mps = adapter.update([track], state, now_s).speed_limit_mps
        slowest_mps = speed_mps - braking_mps2 * CYCLE_S
        assert now_s < 0.5 or limit_mps >= slowest_mps - 0.03
        speed_mps = max(min(limit_mps, speed_mps + CYCLE_S), slowest_mps, 0.0)
        driven_m += speed_mps * CYCLE_S


@settings(max_examples=30, deadline=None)
@given(
    walk=st.tuples(st.floats(0.12, 1.4), st.floats(-math.pi, math.pi)),
    place=st.tuples(st.floats(0.8, 4.0), st.floats(-1.6, 1.6)),
    preset=st.sampled_from(["balanced", "assertive"]),
)
def test_who_walks_as_fast_as_their_awareness_lets_them_sets_no_step(walk, place, preset) -> None:
    """The limit does not rise as their awareness falls a little."""
    policy = AwarenessPolicy.preset(preset)
    low, high = 0.0, 1.0
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        fast = policy.speed.human_speed_mps(middle) > walk[0]
        low, high = (middle, high) if fast else (low, middle)
    velocity = walk[0] * math.cos(walk[1]), walk[0] * math.sin(walk[1])

    def limit(lower: float) -> float:
        track = person(position=place, velocity=velocity, awareness_lower=lower)
        return settled_update([replace(track, noticed=0.0)], policy=policy).speed_limit_mps

    assert limit(low - 1e-6 if low > 0.0 else low) <= limit(high) + 0.003


@pytest.mark.parametrize("sigma_m", [0.05, 0.15])
def test_a_place_that_grows_surer_counts_all_the_same_for_who_walks_on(sigma_m: float) -> None:
    spreads = [-1.0, -0.1, -1e-9, 0.0, 1e-9]
    limits = [
        limit_of(
            knowing(3.4, 0.2, math.inf, -1.2, 0.0)._replace(
                variances=(sigma_m**2, each * sigma_m**2, 0.25 * sigma_m**2)
            )
        )
        for each in spreads
    ]
    assert limits == sorted(limits, reverse=True)
    assert limits[2] == pytest.approx(limits[3], abs=1e-3)
