"""Clipped twists leave slack, and hold in the next cycles too if people do as predicted."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, SCANNER, crowds, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotState
from nav_adapter.motion import clip_twists, clip_twists_ahead, twist_envelope
from perception.arrays import FloatArray
from tracking import PersonTrack

ROUNDING = 1e-9
# The field is computed in single precision.
SINGLE = 1e-5
CYCLE_S = 0.05
TURNS = replace(ROBOT, max_yaw_rate_radps=1.2)
TWISTS = st.tuples(finite(-2.0, 2.0), finite(-2.0, 2.0), finite(-3.0, 3.0))


def limited(limit_mps: float, fastest_mps: float) -> NavConstraints:
    return NavConstraints(
        0.0, (), limit_mps, "a test", False, fastest_point_limit_mps=fastest_mps, robot=TURNS
    )


@given(
    limit_mps=finite(0.0, 1.5),
    more_mps=st.sampled_from([0.0, 0.5, math.inf]),
    less_mps=st.tuples(finite(0.0, 0.3), finite(0.0, 0.3)),
    twist=TWISTS,
)
def test_slack_is_left_below_the_limit_of_the_fastest_point(limit_mps, more_mps, less_mps, twist):
    constraints = limited(limit_mps, limit_mps + more_mps)
    rows, radius_m = twist_envelope(constraints), TURNS.circumscribed_radius_m
    small, large = sorted(less_mps)
    for wanted in (np.array(twist), np.array([twist[0], twist[2]])):
        less, least = (clip_twists(constraints, wanted, slack_mps=mps) for mps in (small, large))
        for clipped, slack_mps in ((less, small), (least, large)):
            speed, turning = math.hypot(*clipped[:-1]), float(clipped[-1])
            assert (rows[:, :2] @ [speed, turning] >= rows[:, 2] - ROUNDING).all()
            left_mps = max(limit_mps + more_mps - slack_mps, 0.0)
            assert speed + radius_m * abs(turning) <= left_mps + ROUNDING
        assert (np.abs(least) <= np.abs(less)).all()


@st.composite
def driving(draw: st.DrawFn) -> RobotState:
    speed = draw(finite(-0.5, 1.5))
    lateral = draw(st.sampled_from([0.0, 0.3]))
    return RobotState(
        0.0,
        np.zeros(2),
        draw(finite(-4.0, 4.0)),
        speed,
        draw(finite(-1.2, 1.2)),
        np.array([speed, lateral]),
    )


@settings(max_examples=30)
@given(tracks=crowds(), state=driving(), twist=TWISTS, less_mps=st.tuples(*2 * [finite(0.0, 0.3)]))
def test_looking_ahead_never_makes_a_twist_faster(tracks, state, twist, less_mps) -> None:
    constraints = settled_update(tracks, state=state, robot=TURNS)
    wanted, (small, large) = np.array(twist), sorted(less_mps)

    def ahead(slack_mps: float, cycles: int) -> FloatArray:
        return clip_twists_ahead(
            constraints, state, wanted, CYCLE_S, cycles=cycles, slack_mps=slack_mps
        )

    now = clip_twists(constraints, wanted, slack_mps=small)
    assert ahead(small, 0).tolist() == now.tolist()
    few, more = ahead(small, 1), ahead(small, 3)
    assert (np.abs(few) <= np.abs(now) + ROUNDING).all()
    assert (np.abs(more) <= np.abs(few) + SINGLE).all()
    assert (np.abs(ahead(large, 1)) <= np.abs(few) + ROUNDING).all()
    # While the robot brakes to a twist, it may turn less.
    still_mps = state.travel_mps - TURNS.max_deceleration_mps2 * CYCLE_S
    flatter = (
        np.cross(few, wanted) if math.hypot(*few[:2]) >= still_mps else np.cross(few, wanted)[2]
    )
    np.testing.assert_allclose(flatter, 0.0, atol=ROUNDING)


@settings(max_examples=30)
@given(
    tracks=crowds(),
    state=driving(),
    twist=TWISTS,
    away_m=finite(0.0, 4.0),
    robot=st.sampled_from([TURNS, replace(TURNS, drive="differential")]),
    slack_mps=finite(0.0, 0.1),
    policy=st.sampled_from([AwarenessPolicy(), AwarenessPolicy(without=SCANNER)]),
)
def test_a_twist_alone_is_slowed_down_exactly_as_in_a_row_of_twists(
    tracks, state, twist, away_m, robot, slack_mps, policy
):
    # A single twist is computed on plain floats, a row by the field, in single precision.
    farther = tuple(
        replace(track, position_odom_m=track.position_odom_m * (1.0 + away_m)) for track in tracks
    )
    constraints = settled_update(farther, policy=policy, state=state, robot=robot)
    alone = clip_twists_ahead(constraints, state, twist, CYCLE_S, slack_mps=slack_mps)
    row = clip_twists_ahead(constraints, state, [twist], CYCLE_S, slack_mps=slack_mps)
    assert alone == pytest.approx(row[0], abs=0.01)


def driven(state: RobotState, twist: FloatArray, time_s: float) -> RobotState:
    """Return the state after a time with a constant twist, in a thousand short steps."""
    step_s = time_s / 1000
    heading = state.heading_odom_rad + step_s * twist[-1] * (np.arange(1000) + 0.5)
    steps = np.array([np.cos(heading), np.sin(heading)]) * twist[0]
    if len(twist) == 3:
        steps += np.array([-np.sin(heading), np.cos(heading)]) * twist[1]
    return RobotState(
        state.stamp_s + time_s,
        state.position_odom_m + step_s * steps.sum(axis=1),
        state.heading_odom_rad + time_s * float(twist[-1]),
        float(twist[0]),
        float(twist[-1]),
        twist[:2] if len(twist) == 3 else None,
    )


def walked(track: PersonTrack, time_s: float) -> PersonTrack:
    position = track.position_odom_m + time_s * track.velocity_odom_mps
    return replace(track, stamp_s=track.stamp_s + time_s, position_odom_m=position)


@settings(max_examples=30)
@given(tracks=crowds(), state=driving(), twist=TWISTS, sideways=st.booleans())
def test_a_twist_that_is_held_keeps_the_limits_of_the_next_cycles(tracks, state, twist, sideways):
    wanted = np.array(twist if sideways else [twist[0], twist[2]])
    adapter = NavAdapter(AwarenessPolicy(), TURNS)
    for ago_s in (0.3, 0.2, 0.1, 0.0):
        people = [walked(track, -ago_s) for track in tracks]
        constraints = adapter.update(people, replace(state, stamp_s=-ago_s), -ago_s)
    command = clip_twists_ahead(constraints, state, wanted, CYCLE_S, cycles=2, slack_mps=0.0)
    for time_s in (CYCLE_S, 2 * CYCLE_S):
        people = [walked(track, time_s) for track in tracks]
        then = adapter.update(people, driven(state, command, time_s), time_s)
        assert then.fastest_point_limit_mps is not None
        speed = math.hypot(*command[:-1])
        fastest_mps = speed + TURNS.circumscribed_radius_m * abs(command[-1])
        assert speed <= then.speed_limit_mps + ROUNDING
        # The field ends at the robot's maximum; corners may be faster where people allow it.
        if then.limited_by != "robot maximum":
            assert fastest_mps <= then.fastest_point_limit_mps + 1e-3


@settings(max_examples=20)
@given(tracks=crowds(), state=driving(), turning=finite(-1.2, 1.2))
def test_a_robot_that_is_still_too_fast_turns_less(tracks, state, turning) -> None:
    constraints = settled_update(tracks, state=state, robot=TURNS)
    assert constraints.fastest_point_limit_mps is not None
    command = clip_twists_ahead(constraints, state, [0.0, turning], CYCLE_S, slack_mps=0.0)
    still_mps = max(state.travel_mps - TURNS.max_deceleration_mps2 * CYCLE_S, 0.0)
    corner_mps = still_mps + TURNS.circumscribed_radius_m * abs(command[1])
    assert corner_mps <= max(constraints.fastest_point_limit_mps, still_mps) + ROUNDING


def test_somebody_who_comes_nearer_slows_the_robot_a_cycle_early() -> None:
    state = robot_at(speed_mps=0.6)
    walks = person(position=(3.0, 0.0), velocity=(-1.2, 0.0))
    constraints = settled_update((walks,), state=state, robot=TURNS)
    limits = [
        float(clip_twists_ahead(constraints, state, (1.5, 0.0), CYCLE_S, cycles=n, slack_mps=0)[0])
        for n in range(4)
    ]
    assert limits[0] == constraints.speed_limit_mps
    steps = -np.diff(limits)
    # The gap closes by 1.8 m/s · 0.05 s a cycle, and the limit falls by about half as much; the
    # field's steps of time are coarse.
    assert (steps >= 0.0).all()
    assert 0.06 < steps.sum() < 0.27
    slack = clip_twists_ahead(constraints, state, (1.5, 0.0), CYCLE_S, slack_mps=0.03)
    assert slack[0] == pytest.approx(limits[2] - 0.03)
