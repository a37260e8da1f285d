"""Commands of a robot that obeys the limits: speeds with yaw rates, and velocities for wheels.

The limit holds for the fastest point of the robot, and the corners of a turning robot move too. So
a command is a *twist*, the speed and the yaw rate together::

    |v| ≤ speed_limit_mps   and   |v| + |ω| R ≤ fastest_point_limit_mps

with the circumscribed radius R about the base origin. A robot that steers has a third limit, its
curvature: |ω| ≤ |v| / ``min_turning_radius_m``. ``docs/planners.md`` shows the functions in
use, and assumption 4 of ``docs/safety.md`` says what they are for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from perception.arrays import FloatArray, finite_array, finite_number

from ._constraints import NavConstraints
from ._errors import NavError
from ._robot import LATERAL_NOISE_MPS, RobotProfile, RobotState
from .course import travel_bearing_rad
from .rigid import Motion
from .rules import Courses, Unseen, lowest, rules_of

__all__ = [
    "ControlPoint",
    "clip_twists",
    "clip_twists_ahead",
    "control_point",
    "differential_drive",
    "twist_envelope",
]

# Behind the robot, within this angle's sine, noise would decide to which side it turns: a turn
# that has begun goes on.
_BEHIND_SINE = 0.3


def twist_envelope(constraints: NavConstraints, *, backward: bool = False) -> FloatArray:
    """Return (M, 3) rows a, c, b: a twist is allowed if a·v + c·ω ≥ b in every row.

    For a solver that chooses v (m/s) and ω (rad/s). The region is convex and contains (0, 0):
    |v| at most the speed limit, |v| + |ω| R at most the limit of the fastest point, and |ω| at most
    ``max_yaw_rate_radps`` of the robot's profile. For a robot that stands, |ω| (R + its width) − v
    is at most ``other_way_limit_mps``. Limits that are not there have no rows.

    The twists of a robot that steers (``min_turning_radius_m``) are two cones, one for each
    direction of travel, and not convex together. The region then holds one of them.

    Args:
        constraints: of the present cycle.
        backward: for a robot that steers, the cone of driving backward; other robots have one
            region for both directions.

    Raises:
        NavError: for constraints without ``robot``.
    """
    limit_mps, fastest_mps, radius_m, highest_radps = _limits_of(constraints)
    rows = [[1.0, 0.0, -limit_mps], [-1.0, 0.0, -limit_mps]]
    if math.isfinite(fastest_mps):
        signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
        rows += [[v, w * radius_m, -fastest_mps] for v, w in signs]
    if math.isfinite(highest_radps):
        rows += [[0.0, 1.0, -highest_radps], [0.0, -1.0, -highest_radps]]
    basis, other_mps = constraints.speed_basis, constraints.other_way_limit_mps
    robot = constraints.robot
    if basis is not None and robot is not None and other_mps < fastest_mps:
        if basis.velocity_base_mps is None:
            # A turn leads another way below v = |ω| · half the width; up to there, all is as slow.
            turn_m = radius_m + 2.0 * robot.half_width_m
            rows += [[1.0, sign * turn_m, -other_mps] for sign in (1.0, -1.0)]
        elif (forward_mps := basis.velocity_base_mps[0]) != 0.0:
            rows.append([math.copysign(1.0, forward_mps), 0.0, -other_mps])
    if (curve_m := _tightest_curve_m(constraints)) > 0.0:
        direction = -1.0 if backward else 1.0
        rows += [[direction, curve_m, 0.0], [direction, -curve_m, 0.0]]
    return np.array(rows)


def clip_twists(constraints: NavConstraints, twists: Any, *, slack_mps: float = 0.0) -> FloatArray:
    """Return twists slowed down until the limits hold, on the same curve.

    All numbers of a twist are multiplied by one factor of at most 1, so the path keeps its
    curvature. Only a curve tighter than ``min_turning_radius_m`` of the profile changes: it becomes
    the tightest one at the same forward speed, and standing robots that steer do not turn. For the
    samples of a sampling planner, and for the last line of any other.

    Args:
        constraints: of the present cycle.
        twists: (..., 2) speed (m/s) and yaw rate (rad/s), or (..., 3) speed forward and to the
            left, and yaw rate, of a robot that can move sideways.
        slack_mps: ≥ 0, speed that the fastest point of the robot leaves unused below its limit, for
            drives that overshoot. More slack never gives a faster twist.

    Raises:
        NavError: for twists that are not finite or of another shape, a slack that is not finite or
            negative, and constraints without ``robot``.
    """
    slack = finite_number("slack_mps", slack_mps, NavError, minimum=0.0)
    return _clipped(constraints, twists, slack, math.inf)


def clip_twists_ahead(
    constraints: NavConstraints,
    robot_state: RobotState,
    twists: Any,
    dt_s: float,
    *,
    cycles: int = 2,
    slack_mps: float = 0.03,
) -> FloatArray:
    """Return twists slowed down until the limits of now and of the next cycles hold.

    A limit is that of a measurement, and a command takes effect after it. Meanwhile robot and
    people come nearer to each other and the limit falls. A planner that uses its limit to the last
    centimetre per second is then too fast for a cycle. So this function also asks the rules for the
    limits at the ends of the next cycles: where each twist leads, and where the robot's present
    motion leads. People move as predicted.
    The lowest of these limits counts, less the slack.

    A robot that cannot brake to a twist's speed within a cycle has less left for turning. Only then
    the curve becomes flatter. Otherwise this is :func:`clip_twists`, and it is never faster.

    For the last line of a planner: one twist takes about as long as an update.

    Args:
        constraints: of ``NavAdapter.update`` in the present cycle.
        robot_state: the latest, from which the constraints come.
        twists: as for :func:`clip_twists`.
        dt_s: > 0, period of the control loop.
        cycles: ≥ 0, how many cycles ahead; 0 for the present limit alone.
        slack_mps: as for :func:`clip_twists`. The default is the overshoot of wheel motors at the
            end of a ramp.

    Raises:
        NavError: as :func:`clip_twists` and ``speed_limit_at``, and for ``cycles`` that are not a
            whole number of at least 0.
    """
    slack = finite_number("slack_mps", slack_mps, NavError, minimum=0.0)
    period_s = _positive("dt_s", dt_s)
    if not isinstance(cycles, int) or cycles < 0:
        raise NavError(f"cycles must be a whole number >= 0, got {cycles!r:.80}")
    now = _clipped(constraints, twists, 0.0, math.inf)
    if cycles == 0 or now.size == 0:
        return _clipped(constraints, twists, slack, math.inf)
    if now.ndim > 1:
        rows = now.reshape(-1, now.shape[-1])
        found = [
            clip_twists_ahead(constraints, robot_state, row, dt_s, cycles=cycles, slack_mps=slack)
            for row in rows
        ]
        return np.array(found).reshape(now.shape)
    robot, fastest_mps = constraints.robot, constraints.fastest_point_limit_mps
    assert robot is not None
    assert fastest_mps is not None
    radius_m, (*velocity, turn) = robot.circumscribed_radius_m, now.tolist()
    still_mps = robot_state.travel_mps - robot.max_deceleration_mps2 * period_s
    needed_mps = max(math.hypot(*velocity), still_mps) + slack + radius_m * abs(turn)
    times_s = period_s * np.arange(1, cycles + 1, dtype=np.float64)
    present = Motion.of(robot_state)
    left_mps = velocity[1] if len(velocity) == 2 else 0.0
    asked = present._replace(forward_mps=velocity[0], left_mps=left_mps, yaw_rate_radps=turn)
    ahead_mps = _lowest_ahead_mps(constraints, {asked, present}, times_s, needed_mps)
    fastest_mps = min(ahead_mps, fastest_mps)
    slower = _clipped(constraints, now, slack, fastest_mps)
    if math.hypot(*slower[:-1].tolist()) < still_mps:
        left_radps = max(fastest_mps - slack - still_mps, 0.0) / radius_m
        slower[-1] = min(max(slower[-1], -left_radps), left_radps)
    return slower


def _lowest_ahead_mps(
    constraints: NavConstraints, motions: Iterable[Motion], times_s: FloatArray, needed_mps: float
) -> float:
    """Return the lowest limit at times ahead on any of the motions; infinite from a speed on."""
    basis, robot = constraints.speed_basis, constraints.robot
    assert robot is not None
    if basis is None and constraints.speed_limit_mps > 0.0:
        raise NavError("constraints must come from NavAdapter.update, got some without speed_basis")
    if basis is None or basis.stopped:
        return 0.0
    least_mps = needed_mps
    if basis.ceiling_mps is not None:
        rise_mps2 = 0.0 if constraints.stale else robot.max_acceleration_mps2
        least_mps = min(least_mps, basis.ceiling_mps + rise_mps2 * float(times_s[0]))
    unseen = Unseen(basis.policy.timing.stale_after_s)
    for motion in motions:
        if robot.moves_sideways is False and abs(motion.left_mps) > LATERAL_NOISE_MPS:
            return 0.0
        if basis.policy.applies(unseen.name):
            bearing_rad = travel_bearing_rad(motion.forward_mps, motion.left_mps)
            least_mps = min(least_mps, unseen.cap(basis.seen_s, bearing_rad, basis.stamp_s))
    people, rules = list(basis.known_ahead(times_s)), rules_of(basis.policy)
    for index, time_s in enumerate(times_s.tolist() if people else ()):
        for motion in motions:
            courses = Courses.of(basis.policy, robot, motion.at(time_s), basis.robot_age_s)
            for ahead in people:
                least_mps = min(least_mps, lowest(ahead[index], courses, rules, least_mps)[0])
    return least_mps if least_mps < needed_mps else math.inf


def _clipped(
    constraints: NavConstraints, twists: Any, slack_mps: float, ahead_mps: Any
) -> FloatArray:
    """Return twists within the limits; ``ahead_mps`` (...) are more limits of the fastest point."""
    given = np.asarray(twists, dtype=np.float64)
    if given.ndim < 1 or given.shape[-1] not in (2, 3) or not bool(np.isfinite(given).all()):
        raise NavError(
            "twists must be finite, (..., 2) speed and yaw rate or (..., 3) with the speed to the "
            f"left between them, got shape {given.shape}"
        )
    limit_mps, fastest_mps, radius_m, highest_radps = _limits_of(constraints)
    curve_m = _tightest_curve_m(constraints)
    other_mps = constraints.other_way_limit_mps
    if given.ndim == 1 and isinstance(ahead_mps, float):
        # The same for one twist, in a tenth of the time.
        *velocity, turn = given.tolist()
        if curve_m > 0.0:
            most = abs(velocity[0]) / curve_m
            turn = min(max(turn, -most), most)
        pace, turning = math.sqrt(sum(part * part for part in velocity)), abs(turn)
        if other_mps < fastest_mps and _leads_another_way(constraints, *velocity, turn):
            fastest_mps = other_mps
        point_mps = max(min(fastest_mps, ahead_mps) - slack_mps, 0.0)
        share = min(
            _share_of_one(pace, limit_mps),
            _share_of_one(turning, highest_radps),
            _share_of_one(pace + radius_m * turning, point_mps),
        )
        return np.array([share * part for part in (*velocity, turn)])
    if curve_m > 0.0:
        given = given.copy()
        most_radps = np.abs(given[..., 0]) / curve_m
        given[..., -1] = np.minimum(np.maximum(given[..., -1], -most_radps), most_radps)
    speed = np.sqrt((given[..., :-1] ** 2).sum(axis=-1))
    yaw_rate = np.abs(given[..., -1])
    factor = np.minimum(_share(speed, limit_mps), _share(yaw_rate, highest_radps))
    fastest = np.minimum(fastest_mps, ahead_mps)
    if other_mps < fastest_mps:
        another = _leads_another_way(constraints, *np.moveaxis(given, -1, 0))
        fastest = np.where(another, np.minimum(fastest, other_mps), fastest)
    fastest = np.maximum(fastest - slack_mps, 0.0)
    factor = np.minimum(factor, _share(speed + radius_m * yaw_rate, fastest))
    return np.asarray(given * factor[..., None])


def _leads_another_way(constraints: NavConstraints, forward: Any, *left_and_turn: Any) -> Any:
    """Return whether a twist leads another way than the one that the speed limit is for.

    From a stand that is backwards or sideways, also for a point of the rear edge alone.
    """
    basis, robot = constraints.speed_basis, constraints.robot
    if basis is None or robot is None:
        return np.zeros(np.shape(forward), dtype=bool)  # nothing is known
    if basis.velocity_base_mps is not None:
        moves_forward, moves_left = basis.velocity_base_mps
        left = left_and_turn[0] if len(left_and_turn) == 2 else 0.0
        return forward * moves_forward + left * moves_left < 0.0
    another = forward < abs(left_and_turn[-1]) * robot.half_width_m
    if len(left_and_turn) == 2:
        another = another | (abs(left_and_turn[0]) > LATERAL_NOISE_MPS)
    return another


class ControlPoint(NamedTuple):
    """A point ahead of a differential drive that can move in every direction.

    Attributes:
        position_odom_m: (2,).
        velocity_odom_mps: (2,).
    """

    position_odom_m: FloatArray
    velocity_odom_mps: FloatArray


def control_point(robot_state: RobotState, ahead_m: float) -> ControlPoint:
    """Return the point ahead of the base origin that :func:`differential_drive` moves.

    A planner for discs, such as ORCA, plans for this point: position and velocity are the agent's,
    and the disc around it must hold the whole footprint.

    Args:
        robot_state: the latest.
        ahead_m: > 0.

    Raises:
        NavError: for a distance that is not finite or not positive.
    """
    ahead = _positive("ahead_m", ahead_m)
    heading, left = _axes(robot_state)
    return ControlPoint(
        robot_state.position_odom_m + ahead * heading,
        robot_state.speed_mps * heading + ahead * robot_state.yaw_rate_radps * left,
    )


def differential_drive(
    velocity_odom_mps: Any,
    robot_state: RobotState,
    robot: RobotProfile,
    *,
    constraints: NavConstraints | None = None,
    dt_s: float | None = None,
    ahead_m: float | None = None,
) -> tuple[float, float]:
    """Return the speed and yaw rate with which a robot on wheels follows a velocity.

    Many planners choose a velocity in the plane, and two wheels cannot move sideways. A point at a
    distance d ahead of the base origin can: with the heading h and its left normal n it moves at
    v h + d ω n. So v = u·h and ω = u·n / d give this point the velocity u exactly. This is the
    input-output linearisation of the unicycle (Siciliano, Sciavicco, Villani and Oriolo 2009,
    "Robotics: Modelling, Planning and Control", chapter 11). Nothing is divided by the speed, so a
    velocity near 0 gives a command near (0, 0) and noise does not turn the robot.

    The robot does not reverse. A velocity that leads backwards gives v = 0 and ω = ±|u| / d until
    the robot faces it. Straight behind, a turn that has begun goes on. A robot that steers cannot
    turn on the spot: where the curve would be tighter than ``min_turning_radius_m``, it drives the
    tightest one with this yaw rate, and the point no longer moves along u.

    Limits slow both numbers by the same factor, so the direction does not change. They are the
    profile's ``max_speed_mps`` and ``max_yaw_rate_radps`` and, with ``constraints``, those of
    :func:`clip_twists`. With ``dt_s`` the command also lies within the accelerations of the
    profile. Where these do not reach the limits within ``dt_s``, it is the nearest that they reach.

    Args:
        velocity_odom_mps: (2,) wanted velocity u.
        robot_state: the latest.
        robot: limits of the motion.
        constraints: limits of the present cycle; None for the profile's alone.
        dt_s: > 0, the time for which the command is held; None if the drive ramps by itself.
        ahead_m: d > 0; the robot's circumscribed radius by default. The heading follows with the
            time constant d / |u|. Shorter distances follow faster and swing the corners more: for
            d = R, |v| + |ω| R is at most √2 |u|. It should be longer than |u| times the period of
            the control loop.

    Returns:
        Speed ≥ 0 (m/s), unless the robot still rolls backwards, and yaw rate (rad/s,
        counter-clockwise).

    Raises:
        NavError: for an argument that is not finite or out of bounds.
    """
    wanted = finite_array("velocity_odom_mps", velocity_odom_mps, (2,), NavError)
    ahead = robot.circumscribed_radius_m if ahead_m is None else _positive("ahead_m", ahead_m)
    heading, left = _axes(robot_state)
    forward_mps, left_mps = float(wanted @ heading), float(wanted @ left)
    speed, yaw_rate = forward_mps, left_mps / ahead
    if forward_mps < 0.0:
        length_mps = math.hypot(forward_mps, left_mps)
        turning = robot_state.yaw_rate_radps
        keeps_on = abs(left_mps) <= _BEHIND_SINE * length_mps and turning != 0.0
        speed, yaw_rate = 0.0, math.copysign(length_mps / ahead, turning if keeps_on else left_mps)

    curve_m = robot.min_turning_radius_m or 0.0
    speed = max(speed, abs(yaw_rate) * curve_m)
    twist = clip_twists(_limits_alone(robot), [speed, yaw_rate])
    if constraints is not None:
        if constraints.robot is None:
            constraints = replace(constraints, robot=robot)
        twist = clip_twists(constraints, twist)
    speed, yaw_rate = twist.tolist()
    if dt_s is None:
        return speed, yaw_rate
    period_s = _positive("dt_s", dt_s)
    now, turning = robot_state.speed_mps, robot_state.yaw_rate_radps
    faster, slower = robot.max_acceleration_mps2, robot.max_deceleration_mps2
    if now < 0.0:  # braking leads up to 0
        faster, slower = slower, faster
    slowest = now - slower * period_s
    speed = min(max(speed, slowest), now + faster * period_s)
    change = math.inf
    if robot.max_yaw_acceleration_radps2 is not None:
        change = robot.max_yaw_acceleration_radps2 * period_s
    if constraints is not None:
        # A robot that is still too fast has less left for turning, and the other way round.
        most = constraints.yaw_rate_limit_radps(speed)
        yaw_rate = min(max(yaw_rate, -most), most)
    yaw_rate = min(max(yaw_rate, turning - change), turning + change)
    if constraints is not None:
        _, fastest_mps, radius_m, _ = _limits_of(constraints)
        speed = max(min(speed, fastest_mps - abs(yaw_rate) * radius_m), slowest, min(speed, 0.0))
    if curve_m > 0.0:  # the yaw rate of a robot that steers falls with its speed
        yaw_rate = min(max(yaw_rate, -abs(speed) / curve_m), abs(speed) / curve_m)
    return speed, yaw_rate


def _share(value: FloatArray, most: float | FloatArray) -> FloatArray:
    """Return the factor of at most 1 that brings each value down to ``most``."""
    above = value > most
    return np.asarray(np.where(above, most / np.where(above, value, 1.0), 1.0))


def _share_of_one(value: float, most: float) -> float:
    """Return the factor of at most 1 that brings a value down to ``most``."""
    return most / value if value > most else 1.0


def _limits_alone(robot: RobotProfile) -> NavConstraints:
    """Return constraints without people."""
    return NavConstraints(
        stamp_s=0.0,
        obstacles=(),
        speed_limit_mps=robot.max_speed_mps,
        limited_by="robot maximum",
        stale=False,
        fastest_point_limit_mps=math.inf,
        robot=robot,
    )


def _limits_of(constraints: NavConstraints) -> tuple[float, float, float, float]:
    """Return the limits of speed and of the fastest point (m/s), R (m) and the yaw rate's limit."""
    robot = constraints.robot
    if robot is None:
        raise NavError(
            "a twist needs constraints with a robot, as NavAdapter.update gives them; these have "
            "robot=None"
        )
    fastest_mps = constraints.fastest_point_limit_mps
    assert fastest_mps is not None
    highest = math.inf if robot.max_yaw_rate_radps is None else robot.max_yaw_rate_radps
    return constraints.speed_limit_mps, fastest_mps, robot.circumscribed_radius_m, highest


def _tightest_curve_m(constraints: NavConstraints) -> float:
    """Return the smallest turning radius of the robot, 0 for one that turns on the spot."""
    robot = constraints.robot
    return 0.0 if robot is None else robot.min_turning_radius_m or 0.0


def _axes(robot_state: RobotState) -> tuple[FloatArray, FloatArray]:
    """Return the unit vectors forward and left in odom."""
    c, s = math.cos(robot_state.heading_odom_rad), math.sin(robot_state.heading_odom_rad)
    return np.array([c, s]), np.array([-s, c])


def _positive(name: str, value: float) -> float:
    return finite_number(name, value, NavError, minimum=0.0, exclusive_minimum=True)
