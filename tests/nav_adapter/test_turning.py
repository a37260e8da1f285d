"""The limit of the fastest point: yaw rate, envelope, clipping, steering and wheels."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, crowds, finite, person, robot_at, settled_update

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, RobotProfile, RobotState
from nav_adapter.motion import clip_twists, control_point, differential_drive, twist_envelope
from perception.arrays import FloatArray

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
def test_no_point_of_a_robot_within_the_yaw_limit_is_too_fast(robot, limit_mps, share, turn):
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


def test_where_nobody_limits_the_robot_it_turns_at_full_speed() -> None:
    alone = NavAdapter(AwarenessPolicy.preset("balanced"), TURNS).update((), robot_at(), 0.0)
    assert alone.limited_by == "robot maximum"
    assert alone.fastest_point_limit_mps == math.inf
    assert alone.yaw_rate_limit_radps(1.5) == 1.2
    assert alone.robot is TURNS
    unknown = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT).update((), robot_at(), 0.0)
    assert unknown.yaw_rate_limit_radps(1.5) == math.inf


@settings(max_examples=40)
@given(tracks=crowds())
def test_people_limit_the_fastest_point_as_they_limit_the_speed(tracks) -> None:
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


@given(
    robot=ROBOTS,
    limit_mps=finite(0.0, 1.5),
    more_mps=st.sampled_from([0.0, 0.5, math.inf]),
    v=finite(-2.0, 2.0),
    w=finite(-3.0, 3.0),
)
def test_the_envelope_is_where_both_limits_hold(robot, limit_mps, more_mps, v, w) -> None:
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
def test_clipped_twists_keep_their_curve_and_the_limits(robot, limit_mps, more_mps, twist) -> None:
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


RADIUS_M = 1.4
STEERS = replace(
    ROBOT,
    footprint_m=np.array([[0.5, 0.5], [-2.1, 0.5], [-2.1, -0.5], [0.5, -0.5]]),
    drive="ackermann",
    max_yaw_rate_radps=0.8,
    max_yaw_acceleration_radps2=2.0,
    min_turning_radius_m=RADIUS_M,
)


def tightest_radps(speed: float) -> float:
    return abs(speed) / RADIUS_M


@given(limit_mps=finite(0.0, 1.5), speed=finite(-1.5, 1.5))
def test_the_yaw_limit_is_the_curve_and_the_fastest_point(limit_mps: float, speed: float) -> None:
    alone, among = limited(limit_mps, STEERS, math.inf), limited(limit_mps, STEERS)
    assert alone.yaw_rate_limit_radps(speed) == min(tightest_radps(speed), 0.8)
    left = max(0.0, limit_mps - abs(speed)) / STEERS.circumscribed_radius_m
    assert among.yaw_rate_limit_radps(speed) == pytest.approx(min(tightest_radps(speed), left, 0.8))
    assert among.yaw_rate_limit_radps(0.0) == 0.0


@given(limit_mps=finite(0.1, 1.5), v=finite(-2.0, 2.0), w=finite(-1.5, 1.5), backward=st.booleans())
def test_each_cone_of_the_envelope_is_the_twists_of_its_direction(limit_mps, v, w, backward):
    constraints = limited(limit_mps, STEERS)
    rows = twist_envelope(constraints, backward=backward)
    assert (rows[:, 2] <= 0.0).all()  # standing is in both
    slack = float((rows[:, :2] @ [v, w] - rows[:, 2]).min())
    within = min(limit_mps - abs(v), constraints.yaw_rate_limit_radps(v) - abs(w))
    way = -v if backward else v
    if min(abs(within), abs(way)) > ROUNDING:
        assert (slack > 0.0) == (within > 0.0 and way > 0.0)


@given(limit_mps=finite(0.0, 1.5), twist=st.tuples(finite(-2, 2), finite(-3, 3)))
def test_clipped_twists_can_be_driven(limit_mps: float, twist: tuple[float, float]) -> None:
    v, w = clip_twists(limited(limit_mps, STEERS), twist).tolist()
    assert abs(w) <= min(tightest_radps(v), 0.8) + ROUNDING
    assert abs(v) + abs(w) * STEERS.circumscribed_radius_m <= limit_mps + ROUNDING
    assert v * twist[0] >= 0.0
    assert w * twist[1] >= 0.0
    if abs(twist[1]) <= tightest_radps(twist[0]):  # the curve stays
        assert w * twist[0] == pytest.approx(v * twist[1], abs=1e-9)
    else:
        assert abs(w) == pytest.approx(tightest_radps(v), abs=1e-9)
    samples = np.array([[twist, twist], [(1.0, 0.1), twist]])
    np.testing.assert_array_equal(clip_twists(limited(limit_mps, STEERS), samples)[1, 1], [v, w])


@given(
    velocity=st.tuples(finite(-2.0, 2.0), finite(-2.0, 2.0)),
    speed=finite(0.0, 1.5),
    turn=finite(-1.0, 1.0),
    limit_mps=st.none() | finite(0.0, 1.5),
    dt_s=st.none() | finite(0.02, 0.2),
)
def test_a_velocity_becomes_a_curve_that_can_be_driven(velocity, speed, turn, limit_mps, dt_s):
    state = RobotState(0.0, np.zeros(2), 0.0, speed, turn * min(tightest_radps(speed), 0.8))
    constraints = None if limit_mps is None else limited(limit_mps, STEERS)
    v, w = differential_drive(velocity, state, STEERS, constraints=constraints, dt_s=dt_s)
    assert v >= 0.0
    assert abs(w) <= tightest_radps(v) + ROUNDING
    if dt_s is None and limit_mps is None and math.hypot(*velocity) > 1e-6:
        assert v > 0.0  # also where the velocity leads backward
        assert velocity[1] * w >= 0.0 or velocity[0] < 0.0


UNLIMITED = replace(ROBOT, max_speed_mps=15.0)
STATES = st.builds(
    lambda heading, speed, yaw_rate: RobotState(0.0, (1.0, -2.0), heading, speed, yaw_rate),
    finite(-4.0, 4.0),
    finite(0.0, 1.5),
    finite(-1.2, 1.2),
)
VELOCITIES = st.tuples(finite(-2.0, 2.0), finite(-2.0, 2.0))


def moves_at(state: RobotState, command: tuple[float, float], ahead_m: float) -> FloatArray:
    """Return the velocity of the point ahead under a command, by a difference of positions."""
    speed, yaw_rate = command

    def place(t: float) -> FloatArray:
        heading = state.heading_odom_rad + yaw_rate * t
        middle = state.heading_odom_rad + 0.5 * yaw_rate * t
        along = speed * t * np.sinc(0.5 * yaw_rate * t / math.pi)
        base = state.position_odom_m + along * np.array([math.cos(middle), math.sin(middle)])
        return np.asarray(base + ahead_m * np.array([math.cos(heading), math.sin(heading)]))

    return np.asarray((place(1e-5) - place(-1e-5)) / 2e-5)


@given(state=STATES, velocity=VELOCITIES, ahead_m=finite(0.2, 1.0))
def test_the_point_ahead_moves_as_wanted(state, velocity, ahead_m) -> None:
    heading = np.array([math.cos(state.heading_odom_rad), math.sin(state.heading_odom_rad)])
    command = differential_drive(velocity, state, UNLIMITED, ahead_m=ahead_m)
    assert command[0] >= 0.0
    if np.array(velocity) @ heading >= 0.0:
        np.testing.assert_allclose(moves_at(state, command, ahead_m), velocity, atol=1e-4)


@given(state=STATES, ahead_m=finite(0.2, 1.0))
def test_there_and_back(state: RobotState, ahead_m: float) -> None:
    """The velocity of the point ahead gives the command that moves it so."""
    point = control_point(state, ahead_m)
    command = differential_drive(point.velocity_odom_mps, state, UNLIMITED, ahead_m=ahead_m)
    assert command[0] == pytest.approx(state.speed_mps, abs=ROUNDING)
    if state.speed_mps > 1e-6:
        assert command[1] == pytest.approx(state.yaw_rate_radps, abs=ROUNDING)
    np.testing.assert_allclose(
        point.velocity_odom_mps,
        moves_at(state, (state.speed_mps, state.yaw_rate_radps), ahead_m),
        atol=1e-4,
    )


@given(state=STATES, velocity=VELOCITIES, limit_mps=finite(0.0, 1.5))
def test_limits_slow_the_point_and_keep_its_direction(state, velocity, limit_mps) -> None:
    constraints = limited(limit_mps, TURNS)
    free = np.array(differential_drive(velocity, state, UNLIMITED))
    speed, yaw_rate = differential_drive(velocity, state, TURNS, constraints=constraints)
    assert speed + abs(yaw_rate) * TURNS.circumscribed_radius_m <= limit_mps + ROUNDING
    assert abs(yaw_rate) <= 1.2 + ROUNDING
    assert speed * free[1] == pytest.approx(yaw_rate * free[0], abs=1e-7)


@given(state=STATES, velocity=VELOCITIES, limit_mps=finite(0.0, 1.5), dt_s=finite(0.02, 0.2))
def test_with_a_period_the_command_can_be_reached(state, velocity, limit_mps, dt_s) -> None:
    constraints = limited(limit_mps, TURNS)
    speed, yaw_rate = differential_drive(velocity, state, TURNS, constraints=constraints, dt_s=dt_s)
    assert abs(speed - state.speed_mps) <= dt_s + ROUNDING
    assert abs(yaw_rate - state.yaw_rate_radps) <= 3.0 * dt_s + ROUNDING
    R = TURNS.circumscribed_radius_m
    slowest = max(state.speed_mps - dt_s, 0.0)
    calmest = max(abs(state.yaw_rate_radps) - 3.0 * dt_s, 0.0)
    # Within the limit of the fastest point, or as near to it as the robot gets in this period.
    assert speed >= 0.0
    assert speed + abs(yaw_rate) * R <= max(limit_mps, slowest + calmest * R) + ROUNDING


def drive(
    state: RobotState, velocity: tuple[float, float], robot: RobotProfile, duration_s: float
) -> list[RobotState]:
    states, dt_s = [state], 0.05
    for _ in range(round(duration_s / dt_s)):
        now = states[-1]
        speed, yaw_rate = differential_drive(velocity, now, robot, dt_s=dt_s)
        heading = now.heading_odom_rad + yaw_rate * dt_s
        way = speed * dt_s * np.array([math.cos(heading), math.sin(heading)])
        states.append(
            RobotState(now.stamp_s + dt_s, now.position_odom_m + way, heading, speed, yaw_rate)
        )
    return states


@pytest.mark.parametrize("robot", [ROBOT, TURNS])
@pytest.mark.parametrize("behind_rad", [0.0, 1.0, 2.5, math.pi, -math.pi + 1e-9, -1.6])
def test_the_robot_turns_to_the_velocity_and_keeps_it(robot, behind_rad) -> None:
    velocity = (0.8 * math.cos(0.7), 0.8 * math.sin(0.7))
    start = RobotState(0.0, (0.0, 0.0), 0.7 + behind_rad, 0.0, 0.0)
    states = drive(start, velocity, robot, 12.0)
    off = [abs(math.remainder(each.heading_odom_rad - 0.7, math.tau)) for each in states]
    assert off[-1] < 1e-3
    assert states[-1].speed_mps == pytest.approx(0.8, abs=1e-3)
    # It turns one way only, except for what limited yaw acceleration carries it too far.
    assert max(np.diff(off), default=0.0) < 0.02


def test_a_turn_goes_on_although_noise_moves_what_is_wanted_behind() -> None:
    rng = np.random.default_rng(3)
    turning = RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.3)
    for noise in rng.normal(0.0, 0.05, 50):
        assert differential_drive((-0.8, noise), turning, ROBOT)[1] > 0.0
    assert differential_drive((-0.8, 0.0), replace(turning, yaw_rate_radps=-0.3), ROBOT)[1] < 0.0


def test_a_robot_that_rolls_backwards_brakes_first() -> None:
    state = RobotState(0.0, (0.0, 0.0), 0.0, -0.5, 0.0)
    hard = replace(TURNS, max_deceleration_mps2=2.0)
    assert differential_drive((1.0, 0.0), state, hard, dt_s=0.1)[0] == pytest.approx(-0.3)
