"""The limit of the fastest point: yaw rate, envelope and clipping, against points of the robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, crowds, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError, RobotProfile
from nav_adapter.motion import clip_twists, twist_envelope
from tracking import PersonTrack

ROUNDING = 1e-9
TURNS = replace(ROBOT, max_yaw_rate_radps=1.2, max_yaw_acceleration_radps2=3.0)
#: A forklift's outline: the base origin is far from the middle, and not on an axis of symmetry.
LOPSIDED = replace(ROBOT, footprint_m=np.array([[1.9, 0.2], [-0.4, 0.5], [-0.6, -0.3]]))
ROBOTS = st.sampled_from([ROBOT, TURNS, LOPSIDED])


def limited(
    limit_mps: float, robot: RobotProfile = ROBOT, fastest_mps: float | None = None
) -> NavConstraints:
    return NavConstraints(
        0.0, (), limit_mps, "a test", False, fastest_point_limit_mps=fastest_mps, robot=robot
    )


def fastest_point_mps(robot: RobotProfile, vx: float, vy: float, yaw_rate: float) -> float:
    """Return the speed of the fastest of many points of the footprint, from rigid motion."""
    weights = np.random.default_rng(0).dirichlet(np.ones(len(robot.footprint_m)), 200)
    x, y = np.vstack([robot.footprint_m, weights @ robot.footprint_m]).T
    return float(np.hypot(vx - yaw_rate * y, vy + yaw_rate * x).max())


@given(robot=ROBOTS, limit_mps=finite(0.0, 1.5), share=finite(-1.0, 1.0), turn=finite(-1.0, 1.0))
def test_no_point_of_a_robot_within_the_yaw_limit_is_too_fast(
    robot: RobotProfile, limit_mps: float, share: float, turn: float
) -> None:
    constraints = limited(limit_mps, robot)
    speed = share * limit_mps
    most = constraints.yaw_rate_limit_radps(speed)
    assert fastest_point_mps(robot, speed, 0.0, turn * most) <= limit_mps + ROUNDING
    assert constraints.yaw_rate_limit_radps(-speed) == most
    if robot.max_yaw_rate_radps is None:
        # At the limit the bound is used up, and on the spot the farthest corner moves at it.
        R = robot.circumscribed_radius_m
        assert abs(speed) + most * R == pytest.approx(limit_mps)
        on_the_spot = constraints.yaw_rate_limit_radps(0.0)
        assert fastest_point_mps(robot, 0.0, 0.0, on_the_spot) == pytest.approx(limit_mps)
    else:
        assert most <= robot.max_yaw_rate_radps


@given(limit_mps=finite(0.0, 1.5), slow=finite(0.0, 2.0), extra=finite(0.0, 1.0))
def test_faster_never_allows_more_turning(limit_mps: float, slow: float, extra: float) -> None:
    constraints = limited(limit_mps, TURNS)
    assert constraints.yaw_rate_limit_radps(slow + extra) <= constraints.yaw_rate_limit_radps(slow)


def test_at_the_limit_or_above_it_the_robot_drives_straight() -> None:
    assert limited(0.8).yaw_rate_limit_radps(0.8) == 0.0
    assert limited(0.8).yaw_rate_limit_radps(1.2) == 0.0
    assert limited(0.0).yaw_rate_limit_radps(0.0) == 0.0


def test_where_nobody_limits_the_robot_it_turns_at_full_speed() -> None:
    alone = NavAdapter(AwarenessPolicy.preset("balanced"), TURNS).update((), robot_at(), 0.0)
    assert alone.limited_by == "robot maximum"
    assert alone.fastest_point_limit_mps == math.inf
    assert alone.yaw_rate_limit_radps(1.5) == 1.2
    assert alone.robot is TURNS
    unknown = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT).update((), robot_at(), 0.0)
    assert unknown.yaw_rate_limit_radps(1.5) == math.inf


@given(tracks=crowds())
def test_people_limit_the_fastest_point_as_they_limit_the_speed(
    tracks: tuple[PersonTrack, ...],
) -> None:
    """Against a robot that is half as fast again, whose own maximum limits nobody nearer."""
    policy = AwarenessPolicy()
    mine = NavAdapter(policy, ROBOT).update(tracks, robot_at(), 0.0)
    fast = replace(ROBOT, max_speed_mps=2.25)
    other = NavAdapter(policy, fast).update(tracks, robot_at(), 0.0)
    fastest_mps = mine.fastest_point_limit_mps
    assert fastest_mps is not None
    assert mine.speed_limit_mps == pytest.approx(min(fastest_mps, 1.5))
    # The steps of time depend on the maximum.
    assert other.speed_limit_mps == pytest.approx(min(fastest_mps, 2.25), rel=0.1, abs=0.05)
    if mine.limited_by != "robot maximum":
        assert fastest_mps == mine.speed_limit_mps


def test_old_data_and_recovery_limit_the_fastest_point_too() -> None:
    policy = AwarenessPolicy.preset("balanced")
    adapter = NavAdapter(policy, ROBOT)
    adapter.update((), robot_at(), 0.0, perception_stamp_s=0.0)
    later_s = policy.timing.stop_after_s + 0.1
    stopped = adapter.update((), robot_at(later_s), later_s, perception_stamp_s=0.0)
    assert stopped.fastest_point_limit_mps == 0.0
    again_s = later_s + 0.05
    slow = adapter.update((), robot_at(again_s), again_s, perception_stamp_s=again_s)
    assert slow.limited_by == "recovery after stale data"
    assert slow.fastest_point_limit_mps == slow.speed_limit_mps


def test_the_watchdog_knows_the_robot_before_the_first_update() -> None:
    waiting = NavAdapter(AwarenessPolicy(), TURNS).watchdog(0.0)
    assert waiting.robot is TURNS
    assert waiting.yaw_rate_limit_radps(0.0) == 0.0


@given(
    robot=ROBOTS,
    limit_mps=finite(0.0, 1.5),
    more_mps=st.sampled_from([0.0, 0.5, math.inf]),
    v=finite(-2.0, 2.0),
    w=finite(-3.0, 3.0),
)
def test_the_envelope_is_where_both_limits_hold(
    robot: RobotProfile, limit_mps: float, more_mps: float, v: float, w: float
) -> None:
    constraints = limited(limit_mps, robot, limit_mps + more_mps)
    rows = twist_envelope(constraints)
    slack = (rows[:, :2] @ [v, w] - rows[:, 2]).min()
    within = limit_mps - abs(v), constraints.yaw_rate_limit_radps(v) - abs(w)
    if min(map(abs, within)) > ROUNDING:
        assert (slack > 0.0) == (min(within) > 0.0)


@given(
    robot=ROBOTS,
    limit_mps=finite(0.0, 1.5),
    more_mps=st.sampled_from([0.0, 0.5, math.inf]),
    twist=st.tuples(finite(-2, 2), finite(-2, 2), finite(-3, 3)),
)
def test_clipped_twists_keep_their_curve_and_the_limits(
    robot: RobotProfile, limit_mps: float, more_mps: float, twist: tuple[float, float, float]
) -> None:
    constraints = limited(limit_mps, robot, limit_mps + more_mps)
    for wanted in (np.array(twist), np.array([twist[0], twist[2]])):
        clipped = clip_twists(constraints, wanted)
        sideways = clipped[1] if len(wanted) == 3 else 0.0
        speed = math.hypot(clipped[0], sideways)
        assert speed <= limit_mps + ROUNDING
        point_mps = fastest_point_mps(robot, clipped[0], sideways, clipped[-1])
        assert point_mps <= limit_mps + more_mps + ROUNDING
        assert abs(clipped[-1]) <= (robot.max_yaw_rate_radps or math.inf) + ROUNDING
        # One factor for all numbers, and the largest that the limits leave.
        size = float(np.abs(wanted).max())
        factor = float(np.abs(clipped).max()) / size if size > 1e-3 else 1.0
        assert 0.0 <= factor <= 1.0
        np.testing.assert_allclose(clipped, factor * wanted, atol=1e-2 if size <= 1e-3 else 1e-9)
        used = [
            (speed, limit_mps),
            (abs(clipped[-1]), robot.max_yaw_rate_radps or math.inf),
            (speed + robot.circumscribed_radius_m * abs(clipped[-1]), limit_mps + more_mps),
        ]
        assert factor == 1.0 or any(value == pytest.approx(most) for value, most in used)


def test_many_samples_are_clipped_as_one_by_one() -> None:
    constraints = settled_update((person(position=(2.0, 0.5)),), robot=TURNS)
    samples = np.random.default_rng(1).normal(0.0, 1.0, (40, 7, 2))
    clipped = clip_twists(constraints, samples)
    assert clipped.shape == samples.shape
    for sample, result in zip(samples.reshape(-1, 2), clipped.reshape(-1, 2), strict=True):
        np.testing.assert_array_equal(clip_twists(constraints, sample), result)


def test_what_has_no_answer_is_refused() -> None:
    alone = NavConstraints(0.0, (), 1.0, "a test", False)
    for ask in (
        lambda: alone.yaw_rate_limit_radps(0.5),
        lambda: clip_twists(alone, [0.1, 0.1]),
        lambda: twist_envelope(alone),
    ):
        with pytest.raises(NavError, match=r"constraints with a robot.*robot=None"):
            ask()
    with pytest.raises(NavError, match="speed_mps must be finite"):
        limited(1.0).yaw_rate_limit_radps(math.nan)
    for twists in (1.0, [1.0], [[0.0, math.nan]], np.zeros((3, 4))):
        with pytest.raises(NavError, match="twists must be finite"):
            clip_twists(limited(1.0), twists)
    with pytest.raises(NavError, match="fastest_point_limit_mps"):
        limited(1.0, fastest_mps=math.nan)
    assert limited(1.0, fastest_mps=0.2).fastest_point_limit_mps == 1.0


@pytest.mark.parametrize("name", ["max_yaw_rate_radps", "max_yaw_acceleration_radps2"])
def test_limits_of_turning_are_positive_or_unknown(name: str) -> None:
    assert getattr(replace(ROBOT, **{name: None}), name) is None
    assert getattr(replace(ROBOT, **{name: 2}), name) == 2.0
    for wrong in (0.0, -1.0, math.inf):
        with pytest.raises(NavError, match=name):
            replace(ROBOT, **{name: wrong})
