"""Speeds at which people may come at the robot, and how soon they can have them."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import FloatArray

from ._memory import PersonMemory

# Shares of the speed that is assumed for unaware people. A person faster than the first share is a
# brisk walker, who may turn to the robot. A person faster than that speed by the second share runs.
BRISK_SHARE: Final = 0.75
RUNNING_SHARE: Final = 0.25


class Turn(NamedTuple):
    """A bound on how soon N people come, in the terms of people who start from standing.

    A person whose track comes nearer at u (negative if it leaves) may have begun δ ago to turn to
    the robot, and be faster by the spread z of the velocity. With accelerations of at most a_h in
    any direction the person has come nearer after t by at most ½ a_h (t + δ)² + (u + z) t. Somebody
    who starts from standing with the delay δ + (u + z)/a_h gets as far, less at most ½ a_h δ². A
    negative delay is the time that it takes to turn round.

    Attributes:
        delay_s: (N,), start delay, at least −(time until the robot brakes); infinite for people who
            may turn at once.
        nearer_m: (N,), by how much they may be nearer then than their track.
    """

    delay_s: FloatArray
    nearer_m: FloatArray


def turn_of(
    closing_mps: FloatArray,
    unnoticed_s: FloatArray,
    spread_mps: FloatArray,
    until_braking_s: FloatArray,
    human_acceleration_mps2: float,
) -> Turn:
    """Return the bound for N people; all arrays are (N,).

    Args:
        closing_mps: u, signed.
        unnoticed_s: δ ≥ 0; infinite for people who may turn at once.
        spread_mps: z ≥ 0.
        until_braking_s: from the stamps of the tracks until the robot brakes.
        human_acceleration_mps2: a_h > 0.
    """
    delay_s = unnoticed_s + (closing_mps + spread_mps) / human_acceleration_mps2
    bounded = np.isfinite(unnoticed_s)
    unnoticed_s = np.where(bounded, unnoticed_s, 0.0)
    counted_s = np.where(bounded, np.maximum(delay_s, 0.0), 0.0)
    nearer_m = 0.5 * human_acceleration_mps2 * np.maximum(unnoticed_s**2 - counted_s**2, 0.0)
    return Turn(np.maximum(delay_s, -until_braking_s), nearer_m)


def human_speed_mps(
    memory: PersonMemory,
    robot_x: float,
    robot_y: float,
    *,
    assumed_mps: float,
    unaware_mps: float,
    turn_rad: float,
) -> float:
    """Return the assumed speed of a person towards the robot.

    It is the policy's assumption, or the closing speed of the track if that is higher: an aware
    person is not expected to step towards the robot, but may do so. Speed above that assumed for
    unaware people is added, since an attentive runner cannot stop as fast as an attentive walker.
    From a quarter above it on, awareness no longer counts: a running person is assumed to run
    straight at the robot.

    Args:
        memory: the person.
        robot_x: position of the robot in odom, in metres.
        robot_y: the same.
        assumed_mps: the policy's assumption for this person.
        unaware_mps: that for unaware people.
        turn_rad: largest turn of a brisk walker towards the robot.
    """
    (x, y), (vx, vy) = memory.track_position_odom_m, memory.velocity_odom_mps
    x, y = x - robot_x, y - robot_y
    distance_m = max(math.hypot(x, y), 1e-9)
    closing_mps = -(vx * x + vy * y) / distance_m
    walking_mps = math.hypot(vx, vy)
    if walking_mps > BRISK_SHARE * unaware_mps:
        across_mps = abs(vx * y - vy * x) / distance_m
        brisk = (walking_mps / max(unaware_mps, 1e-9) - BRISK_SHARE) / (1.0 - BRISK_SHARE)
        turn_rad *= min(brisk, 1.0)
        closing_mps = _closing_after_turn_mps(closing_mps, across_mps, walking_mps, turn_rad)
    excess_mps = walking_mps - unaware_mps
    if excess_mps > 0.0:
        running = min(excess_mps / max(RUNNING_SHARE * unaware_mps, 1e-9), 1.0)
        runner_mps = assumed_mps + running * (walking_mps - assumed_mps)
        assumed_mps = max(assumed_mps + excess_mps, runner_mps)
    return closing_mps if closing_mps > assumed_mps else assumed_mps


def _closing_after_turn_mps(
    closing_mps: float, across_mps: float, walking_mps: float, turn_rad: float
) -> float:
    """Return the closing speed of a brisk walker after the largest turn towards the robot.

    A person at normal pace who has seen the robot stops within a step. A faster one walks on, and
    may be rounding a corner.
    """
    if math.atan2(across_mps, closing_mps) <= turn_rad:
        return walking_mps
    return closing_mps * math.cos(turn_rad) + across_mps * math.sin(turn_rad)
