"""From a velocity to the command of a differential drive, and back."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nav_scenes import ROBOT, finite

from nav_adapter import NavConstraints, NavError, RobotProfile, RobotState
from nav_adapter.motion import control_point, differential_drive
from perception.arrays import FloatArray

ROUNDING = 1e-9
TURNS = replace(ROBOT, max_yaw_rate_radps=1.2, max_yaw_acceleration_radps2=3.0)
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
def test_the_point_ahead_moves_as_wanted(
    state: RobotState, velocity: tuple[float, float], ahead_m: float
) -> None:
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
def test_limits_slow_the_point_and_keep_its_direction(
    state: RobotState, velocity: tuple[float, float], limit_mps: float
) -> None:
    constraints = NavConstraints(0.0, (), limit_mps, "a test", False, robot=TURNS)
    free = np.array(differential_drive(velocity, state, UNLIMITED))
    speed, yaw_rate = differential_drive(velocity, state, TURNS, constraints=constraints)
    assert speed + abs(yaw_rate) * TURNS.circumscribed_radius_m <= limit_mps + ROUNDING
    assert abs(yaw_rate) <= 1.2 + ROUNDING
    assert speed * free[1] == pytest.approx(yaw_rate * free[0], abs=1e-7)


@given(state=STATES, velocity=VELOCITIES, limit_mps=finite(0.0, 1.5), dt_s=finite(0.02, 0.2))
def test_with_a_period_the_command_can_be_reached(
    state: RobotState, velocity: tuple[float, float], limit_mps: float, dt_s: float
) -> None:
    constraints = NavConstraints(0.0, (), limit_mps, "a test", False)
    speed, yaw_rate = differential_drive(velocity, state, TURNS, constraints=constraints, dt_s=dt_s)
    assert abs(speed - state.speed_mps) <= dt_s + ROUNDING
    assert abs(yaw_rate - state.yaw_rate_radps) <= 3.0 * dt_s + ROUNDING
    R = TURNS.circumscribed_radius_m
    slowest = max(state.speed_mps - dt_s, 0.0)
    calmest = max(abs(state.yaw_rate_radps) - 3.0 * dt_s, 0.0)
    # Within the limit of the fastest point, or as near to it as the robot gets in this period.
    assert speed >= 0.0
    assert speed + abs(yaw_rate) * R <= max(limit_mps, slowest + calmest * R) + ROUNDING


@given(heading=finite(-4.0, 4.0), direction=finite(-4.0, 4.0), small=finite(0.0, 1e-3))
def test_next_to_nothing_wanted_is_next_to_nothing_commanded(
    heading: float, direction: float, small: float
) -> None:
    state = RobotState(0.0, (0.0, 0.0), heading, 0.0, 0.0)
    wanted = small * np.array([math.cos(direction), math.sin(direction)])
    speed, yaw_rate = differential_drive(wanted, state, ROBOT)
    assert 0.0 <= speed <= small + ROUNDING
    assert abs(yaw_rate) <= small / ROBOT.circumscribed_radius_m + ROUNDING


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
def test_the_robot_turns_to_the_velocity_and_keeps_it(
    robot: RobotProfile, behind_rad: float
) -> None:
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


def test_a_corner_is_at_most_the_root_of_two_faster_than_wanted() -> None:
    state = RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0)
    R = UNLIMITED.circumscribed_radius_m
    for angle in np.linspace(-math.pi, math.pi, 73):
        command = differential_drive((math.cos(angle), math.sin(angle)), state, UNLIMITED)
        assert command[0] + abs(command[1]) * R <= math.sqrt(2.0) + ROUNDING


def test_wrong_arguments_are_refused() -> None:
    state = RobotState(0.0, (0.0, 0.0), 0.0, 0.0, 0.0)
    with pytest.raises(NavError, match="velocity_odom_mps"):
        differential_drive((math.nan, 0.0), state, ROBOT)
    for name in ("dt_s", "ahead_m"):
        with pytest.raises(NavError, match=name):
            differential_drive((1.0, 0.0), state, ROBOT, **{name: 0.0})
    with pytest.raises(NavError, match="ahead_m"):
        control_point(state, -1.0)
