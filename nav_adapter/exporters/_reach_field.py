"""The limit of :mod:`nav_adapter.limit` at many poses at once: the same steps, on arrays.

It is a lower bound of :func:`~nav_adapter.limit.limit_mps`, since its steps of time are not
refined; fine ones give it itself. Values are floats, or arrays of one number per time or per pose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

from .._constraints import NavConstraints
from .._errors import NavError
from .._people import OLDEST_S, Person, position_sigma_m
from .._predicted import predicted_sigmas_m
from .._robot import LATERAL_NOISE_MPS, RobotProfile
from .._speed_basis import SpeedBasis
from ..limit import ROOM, STANDING_MPS, STEPS
from ..reach import WALKING_ON_S, covariance_terms

Value = Any
# Ages closer than this are equal.
_SAME_AGE_S: Final = 1e-9
# A limit is lowered by this share of itself, for rounding.
_ROUNDING: Final = 1e-9
# Fine steps are as short as the shortest of ``limit_mps``.
_FINER: Final = 8


@dataclass(frozen=True, slots=True)
class Courses:
    """Courses of the robot at N poses; see :class:`~nav_adapter.limit.Course`.

    Attributes:
        x_m: (N,) place of the base.
        y_m: (N,).
        driven_m: how far the robot may have driven since its state.
        cos: direction of the middle of the fan, or None for a robot that may go anywhere at once.
        sin: the same.
        fan_cos: half the opening of the fan.
        fan_sin: the same.
        front_m: of the footprint.
        rear_m: the same.
        half_m: the same.
        straight: cosine and sine of the straight course, and front, rear and half the width along
            it.
    """

    x_m: FloatArray
    y_m: FloatArray
    driven_m: Value
    cos: Value = None
    sin: Value = None
    fan_cos: Value = -1.0
    fan_sin: Value = 0.0
    front_m: Value = 0.0
    rear_m: Value = 0.0
    half_m: Value = 0.0
    straight: tuple[Value, ...] = ()

    def at(self, rows: Any) -> Courses:
        """Return the courses of some poses."""

        def chosen(value: Value) -> Value:
            if isinstance(value, tuple):
                return tuple(chosen(each) for each in value)
            return value[rows] if isinstance(value, np.ndarray) else value

        return replace(
            self, **{each.name: chosen(getattr(self, each.name)) for each in fields(self)}
        )


def courses_of(
    robot: RobotProfile,
    basis: SpeedBasis,
    positions_m: FloatArray,
    headings_rad: FloatArray | None,
    velocities_mps: tuple[FloatArray, Value] | None,
    yaw_rates_radps: Value,
) -> Courses:
    """Return the courses at poses (N, 2), as :func:`~nav_adapter.limit.course_of` has them.

    Args:
        robot: of the constraints.
        basis: of the constraints.
        positions_m: (N, 2).
        headings_rad: (N,), or None for any.
        velocities_mps: forward and left, (N,), or None for a robot that drives forwards.
        yaw_rates_radps: (N,), or 0.
    """
    x, y = positions_m.T
    age_s = basis.robot_age_s
    if velocities_mps is None:
        travel: Value = robot.max_speed_mps
    else:
        forward, left = velocities_mps
        travel = np.hypot(forward, left)
    fastest = np.maximum(travel, robot.max_speed_mps)
    faster_m = 0.5 * robot.max_acceleration_mps2 * age_s**2
    driven_m = np.minimum(travel * age_s + faster_m, fastest * age_s)
    if headings_rad is None or (basis.policy.reach is None and velocities_mps is None):
        return Courses(x, y, driven_m)
    turn_rad = 0.0 if basis.policy.reach is None else math.radians(basis.policy.reach.turn_deg)
    off: Value = 0.0
    speed: Value = travel
    fan_rad: Value = turn_rad
    noise_rad: Value = 0.0
    if velocities_mps is not None:
        sideways = np.abs(left) > LATERAL_NOISE_MPS
        speed = np.where(sideways, travel, np.abs(forward))
        off = np.where(forward <= -STANDING_MPS, math.pi, 0.0)
        off = np.where(sideways, np.arctan2(left, forward), off)
        if robot.moves_sideways is not False:
            noise_rad = np.arctan2(np.abs(left), np.maximum(speed, STANDING_MPS))
            noise_rad = np.where(sideways, 0.0, noise_rad)
        # A robot that stands may start either way, or any way.
        fan_rad = np.where(speed < STANDING_MPS, math.pi, fan_rad)
        if robot.moves_sideways is not False:
            noise_rad = np.where(speed < STANDING_MPS, math.pi, noise_rad)
    stopping_s = robot.reaction_time_s + age_s + 0.5 * speed / robot.max_deceleration_mps2
    half_rad = 0.5 * np.clip(yaw_rates_radps * stopping_s, -math.pi, math.pi)
    fan_rad = np.minimum(fan_rad + noise_rad + 0.5 * np.abs(half_rad), math.pi)
    middle_rad = headings_rad + off + 0.5 * half_rad
    straight = _extents_m(robot, off, 0.0)
    return Courses(
        *(x, y, driven_m, np.cos(middle_rad), np.sin(middle_rad)),
        *(np.cos(fan_rad), np.sin(fan_rad)),
        *_extents_m(robot, off, np.abs(half_rad) + noise_rad),
        straight=(np.cos(headings_rad + off), np.sin(headings_rad + off), *straight),
    )


def _extents_m(robot: RobotProfile, off_rad: Value, swing_rad: Value) -> tuple[Value, Value, Value]:
    """Return what :func:`~nav_adapter.limit._extent_m` does, for arrays of angles."""
    corners = robot.footprint_m
    cos, sin = np.cos(off_rad)[..., None], np.sin(off_rad)[..., None]
    along = cos * corners[:, 0] + sin * corners[:, 1]
    across = cos * corners[:, 1] - sin * corners[:, 0]
    front, rear, half = along.max(-1), along.min(-1), np.abs(across).max(-1)
    if np.ndim(swing_rad) == 0 and swing_rad == 0.0:
        return front, rear, half
    radius, swing_rad = robot.circumscribed_radius_m, np.minimum(swing_rad, 0.5 * math.pi)
    cos, sin = np.cos(swing_rad), np.sin(swing_rad)
    swung = half * cos + np.maximum(front, -rear) * sin
    return (
        np.where(swing_rad > 0.0, np.minimum(front + half * sin, radius), front),
        np.where(swing_rad > 0.0, np.maximum(rear - half * sin, -radius), rear),
        np.where(swing_rad > 0.0, np.minimum(swung, radius), half),
    )


class PersonAhead(NamedTuple):
    """One person at T times, as the adapter will know them if they go straight on.

    Attributes:
        track_id: of the person.
        x_m: place ``elapsed_s`` before each time, a float or (T,) like all of them.
        y_m: the same.
        velocity_x_mps: a float.
        velocity_y_mps: a float.
        speed_mps: U.
        delay_s: δ.
        elapsed_s: age of the place.
        variances: a₀, a₁ and a₂ of :class:`~nav_adapter.reach.Reach`.
        body_m: body radius and uncertainty of the present place.
        least_mps: what a lost person allows at least, or None.
    """

    track_id: int
    x_m: Value
    y_m: Value
    velocity_x_mps: float
    velocity_y_mps: float
    speed_mps: Value
    delay_s: Value
    elapsed_s: Value
    variances: tuple[Value, Value, Value]
    body_m: Value
    least_mps: Value = None


def people_ahead(
    constraints: NavConstraints, times_s: FloatArray, aware_for_s: float
) -> Iterator[PersonAhead]:
    """Yield the people at times (T,) after the stamp of the constraints."""
    basis = constraints.speed_basis
    assert basis is not None
    now, shown = constraints.stamp_s, {track.id: track for track in basis.tracks}
    for track_id, person in basis.people.items():
        is_shown = shown.get(track_id) is person.track
        yield _ahead(basis, now, times_s, aware_for_s, track_id, person, is_shown)
    for track_id, person in basis.lost.items():
        rise_mps2, since_s = basis.policy.timing.lost_rise_mps2 or 0.0, person.lost_since_s or now
        least_mps = (person.lost_limit_mps or 0.0) + rise_mps2 * (now + times_s - since_s)
        ahead = _ahead(basis, now, times_s, aware_for_s, track_id, person, False)
        yield ahead._replace(least_mps=least_mps)


def _ahead(
    basis: SpeedBasis,
    now: float,
    times_s: FloatArray,
    aware_for_s: float,
    track_id: int,
    person: Person,
    is_shown: bool,
) -> PersonAhead:
    """Return a person at times ahead. Those whom the latest frame shows are seen as now."""
    track, policy = person.track, basis.policy
    fresh_s, margins = policy.timing.fresh_within_s, policy.margins
    age_s = max(now - track.stamp_s, 0.0)
    seen_s = min(person.seen_stamp_s, track.stamp_s - track.time_since_seen_s)
    is_seen = is_shown and track.status != "coasting" and now - seen_s <= fresh_s - _SAME_AGE_S
    speed_mps: Value = 0.0
    delay_s: Value = 0.0
    unaware_mps = policy.speed.human_speed_mps(0.0)
    reach = basis.rules.reach(person, now)
    if reach is not None:
        speed_mps, delay_s = reach.speed_mps, reach.delay_s
    unaware_mps = max(unaware_mps, math.hypot(*person.velocity_odom_mps))
    sigmas: Value = basis.rules.sigmas(person, now)
    covariance = track.covariance_odom.tolist()
    variances: tuple[Value, ...] = covariance_terms(covariance, 1.0)
    sigma_m: Value = person.sigma_m
    if not is_seen:
        # No later frame shows them: unaware, and less and less certain.
        unseen = now + times_s - seen_s > fresh_s - _SAME_AGE_S
        speed_mps = np.where(unseen, max(unaware_mps, speed_mps), speed_mps)
        sigmas = np.where(unseen, max(sigmas, margins.unseen_sigmas), sigmas)
        if is_shown:
            if policy.reach is not None:
                later_s = np.minimum(track.stamp_s + times_s - seen_s, fresh_s)
                delay_s = np.maximum(delay_s, policy.reach.delay_s + later_s)
            ahead = [_terms_ahead(covariance, each) for each in times_s.tolist()]
            variances = tuple(np.array(ahead).T)
        until_s = np.minimum(
            age_s + times_s, max(age_s, policy.timing.stop_after_s) + (times_s if is_shown else 0.0)
        )
        sigma_m = np.array([position_sigma_m(track, each) for each in until_s.tolist()])
    if basis.prediction is not None:
        ahead_m = predicted_sigmas_m(track, age_s + times_s, basis.prediction)
        sigma_m = np.maximum(sigma_m, ahead_m)
        variances = (np.maximum(variances[0], ahead_m**2), *variances[1:])
    if aware_for_s < times_s[-1]:
        speed_mps = np.where(times_s > aware_for_s, np.maximum(unaware_mps, speed_mps), speed_mps)
    x, y = person.track_position_odom_m
    vx, vy = person.velocity_odom_mps
    moves_s: Value = times_s if is_shown and (vx or vy) else 0.0
    a0, a1, a2 = (sigmas * sigmas * each for each in variances)
    return PersonAhead(
        *(track_id, x + vx * moves_s, y + vy * moves_s, vx, vy, speed_mps, delay_s),
        min(age_s, OLDEST_S) if is_shown else np.minimum(age_s + times_s, OLDEST_S),
        (a0, a1, a2),
        BODY_RADIUS_M + sigmas * sigma_m,
    )


def _terms_ahead(covariance: list[list[float]], ahead_s: float) -> tuple[float, float, float]:
    """Return the terms of a covariance that is predicted at constant velocity."""
    P = np.array(covariance)
    P[:2] += ahead_s * P[2:]
    P[:, :2] += ahead_s * P[:, 2:]
    return covariance_terms(P.tolist(), 1.0)


def person_limits_mps(
    person: PersonAhead,
    courses: Courses,
    times: Any,
    basis: SpeedBasis,
    robot: RobotProfile,
    reach_m: float = 0.0,
    fine: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Return the limits (N,) that one person sets by the path and by their reach; ∞ for none.

    Args:
        person: at T times.
        courses: at N poses.
        times: (N,) index of the time of each pose.
        basis: of the constraints.
        robot: of the constraints.
        reach_m: the limits hold within this distance of the poses, which have no heading then.
        fine: the steps of time are fine, for a few poses.
    """

    def gathered(value: Value) -> Value:
        return value[times] if isinstance(value, np.ndarray) and value.ndim else value

    margins, rules = basis.policy.margins, basis.policy.reach
    a, maximum = robot.max_deceleration_mps2, ROOM * robot.max_speed_mps
    elapsed = gathered(person.elapsed_s)
    T = robot.reaction_time_s + elapsed
    dx, dy = gathered(person.x_m) - courses.x_m, gathered(person.y_m) - courses.y_m
    circle = robot.circumscribed_radius_m + reach_m
    body = gathered(person.body_m)
    vx, vy = person.velocity_x_mps, person.velocity_y_mps
    path = _path_mps(dx, dy, courses, body, margins.clearance_m, circle, a, T, maximum)
    if np.any(elapsed) and (vx or vy):
        later = dx + vx * elapsed, dy + vy * elapsed
        path = np.minimum(
            path, _path_mps(*later, courses, body, margins.clearance_m, circle, a, T, maximum)
        )
    if rules is None:
        return path, np.full(len(dx), np.inf)
    U, delay = gathered(person.speed_mps), gathered(person.delay_s)
    variances = tuple(gathered(each) for each in person.variances)
    walking = math.hypot(vx, vy)
    given = (dx, dy, vx, vy, elapsed, variances, margins.floor_m)
    room = (robot, T, circle, fine)
    limit = _reach_mps(*given, U, delay, rules.time_constant_s, courses, *room)
    if np.any(walking > U):
        # As in the adapter: whoever walks on is not met by a robot that goes straight on.
        ahead = courses
        if courses.cos is not None:
            cos, sin, front, rear, half = courses.straight
            ahead = replace(
                courses,
                **{"cos": cos, "sin": sin, "fan_cos": 1.0, "fan_sin": 0.0},
                **{"front_m": front, "rear_m": rear, "half_m": half},
            )
        on = _reach_mps(*given, 0.0, 0.0, WALKING_ON_S, ahead, *room)
        limit = np.where(walking > U, np.minimum(limit, on), limit)
    return path, limit


def _reach_mps(
    dx: FloatArray,
    dy: FloatArray,
    vx: float,
    vy: float,
    elapsed: Value,
    variances: tuple[Value, ...],
    margin: float,
    U: Value,
    delay: Value,
    tau: float,
    courses: Courses,
    robot: RobotProfile,
    T: Value,
    circle: float,
    fine: bool,
) -> FloatArray:
    """Return the limits (N,) of :func:`~nav_adapter.limit.limit_mps`; ∞ for none."""
    a, maximum = robot.max_deceleration_mps2, ROOM * robot.max_speed_mps
    walking = math.hypot(vx, vy)
    step_s = robot.max_speed_mps / a / STEPS / (_FINER if fine else 1)
    steps = math.ceil((float(np.max(T)) + maximum / a) / step_s)
    at_once = steps if fine else 1  # a few poses are faster so
    limit = np.full(len(dx), maximum)
    for first in range(0, steps, at_once):
        t0 = step_s * np.arange(first, first + at_once)[:, None]
        t1 = t0 + step_s
        early = np.maximum(t0 - T, 0.0)
        need0, braked0 = a * early, 0.5 * a * early * early
        late = np.maximum(t1 - T, 0.0)
        need1, braked1 = a * late, 0.5 * a * late * late
        m0, m1 = (tau * -np.expm1(-(t + elapsed) / tau) for t in (t0, t1))
        since = t1 + elapsed + delay
        reach = U * (since + tau * np.expm1(-since / tau)) + 0.5 * walking * (m1 - m0)
        variance = variances[0] + m1 * (variances[1] + m1 * variances[2])
        reach = reach + np.sqrt(np.maximum(variance, 0.0))
        middle = 0.5 * (m0 + m1)
        px, py = (dx + vx * middle, dy + vy * middle) if walking else (dx, dy)
        if courses.cos is None:
            near = np.hypot(px, py) - (circle + courses.driven_m + margin + reach)
            lowest = np.maximum(_least_mps(near, t1, braked1, need1, a, T), need0)
        else:
            near, past, behind = _contacts_m(px, py, courses, reach, margin)
            lowest = np.maximum(_least_mps(near, t1, braked1, need1, a, T), need0)
            lowest = np.where(lowest * t0 - braked0 <= past, lowest, maximum)
            lowest = np.where(need0 * t0 - braked0 <= behind, need0, lowest)
        np.minimum(limit, lowest.min(axis=0), out=limit)
        if np.min(need1) >= limit.max():
            break
    return np.where(limit < maximum, limit, np.inf)


def _least_mps(
    near: FloatArray, t1: Value, braked1: Value, need1: Value, a: float, T: Value
) -> FloatArray:
    """Return the lowest speed at which the robot comes as far as ``near`` until t1."""
    least = (near + braked1) / t1
    # A robot that is slow stands before t1.
    stops = np.sqrt(a * (a * T * T + 2.0 * np.maximum(near, 0.0))) - a * T
    return np.asarray(np.where(least < need1, stops, least))


def _path_mps(
    dx: FloatArray,
    dy: FloatArray,
    courses: Courses,
    body: Value,
    clearance: float,
    circle: float,
    a: float,
    T: Value,
    maximum: float,
) -> FloatArray:
    """Return the limits (N,) of the protective field; ∞ for none."""
    if courses.cos is None:
        gap = np.hypot(dx, dy) - circle - courses.driven_m - body - clearance
        inside = np.ones(len(dx), dtype=bool)
    else:
        cos, sin, front, rear, half = courses.straight
        x = cos * dx + sin * dy
        off = np.abs(cos * dy - sin * dx) - half - clearance
        inside = (x >= rear - body) & (off <= body)
        beyond = np.maximum(off, 0.0)
        ahead = np.sqrt(np.maximum(body * body - beyond * beyond, 0.0))
        gap = x - front - courses.driven_m - ahead - clearance
    gap = np.maximum(gap, 0.0)
    limit = 2.0 * gap / (T + np.sqrt(T * T + 2.0 * gap / a) + 1e-300)
    return np.where(inside & (limit < maximum), limit, np.inf)


def _contacts_m(
    px: FloatArray, py: FloatArray, courses: Courses, reach: Value, margin: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what :func:`~nav_adapter.limit.contact_m` does, for people at (px, py)."""
    cos, sin = courses.fan_cos, courses.fan_sin
    front, rear, half = courses.front_m + courses.driven_m, courses.rear_m, courses.half_m
    x = courses.cos * px + courses.sin * py
    y = np.abs(courses.cos * py - courses.sin * px)
    rho, side = reach + margin, half + margin
    distance2 = x * x + y * y
    distance = np.sqrt(distance2)
    low_y = cos * y - sin * x
    in_fan = low_y <= 0.0
    low_x = np.where(in_fan, distance, cos * x + sin * y)
    low_y = np.maximum(low_y, 0.0)
    high_y = cos * y + sin * x
    high_x = np.where(high_y < 0.0, -distance, cos * x - sin * y)
    high_y = np.maximum(high_y, 0.0)
    wide = half + rho
    ahead = (low_x >= 0.0) & (low_y < wide)
    backward = (high_x < 0.0) & (high_y < wide)
    off = np.maximum(low_y - side, 0.0)
    past = low_x - rear + np.sqrt(np.maximum(reach * reach - off * off, 0.0))
    corner2 = np.square(np.maximum(distance - rho, 0.0))
    share = np.maximum(corner2 - half * half, 0.0) / np.maximum(corner2, 1e-12)
    at = np.minimum(np.maximum(distance * np.sqrt(share), high_x), low_x)
    off = np.maximum(np.sqrt(np.maximum(distance2 - at * at, 0.0)) - half, 0.0)
    near = at - front - np.sqrt(np.maximum(rho * rho - off * off, 0.0))
    ahead &= past >= 0.0
    near, past = np.where(ahead, near, 1e9), np.where(ahead, past, -np.inf)
    behind = np.full_like(near, -np.inf)
    if backward.any():
        corner2 = np.square(np.maximum(distance - reach, 0.0))
        share = np.maximum(corner2 - side * side, 0.0) / np.maximum(corner2, 1e-12)
        at = np.minimum(-distance * np.sqrt(share), np.minimum(low_x, 0.0))
        at = np.maximum(at, high_x)
        off = np.maximum(np.sqrt(np.maximum(distance2 - at * at, 0.0)) - side, 0.0)
        end = at - rear + np.sqrt(np.maximum(reach * reach - off * off, 0.0))
        behind = np.where(backward, end, -np.inf)
    return near, past, behind


def limits_at(
    constraints: NavConstraints,
    positions_m: FloatArray,
    headings_rad: FloatArray | None,
    velocities_mps: tuple[FloatArray, Value] | None,
    yaw_rates_radps: Value,
    times_s: FloatArray,
    aware_for_s: float,
    reach_m: float = 0.0,
    fine: bool = False,
) -> tuple[FloatArray, NDArray[np.object_]]:
    """Return the limits (K, T) at poses (K, T, …), and who sets them, as texts.

    Args:
        constraints: of ``NavAdapter.update``, or some that stop the robot.
        positions_m: (K, T, 2).
        headings_rad: (K, T), or None for any.
        velocities_mps: forward and left, (K, T), or None for a robot that drives forwards.
        yaw_rates_radps: (K, T), or 0.
        times_s: (T,) after the stamp.
        aware_for_s: how long awareness counts.
        reach_m: the limits hold within this distance of the poses; they have no heading then.
        fine: the steps of time are fine, for a few poses.

    Raises:
        NavError: for constraints that do not come from ``update`` unless they stop the robot.
    """
    if not isinstance(constraints, NavConstraints):
        raise NavError(f"constraints must be NavConstraints, got {type(constraints).__name__}")
    basis, robot = constraints.speed_basis, constraints.robot
    shape = positions_m.shape[:2]
    limits, texts = np.zeros(shape), np.full(shape, constraints.limited_by, dtype=object)
    if basis is None or robot is None:
        if constraints.speed_limit_mps > 0.0:
            raise NavError(
                "constraints must come from NavAdapter.update, got some without speed_basis"
            )
        return limits, texts
    limits[:], texts[:] = robot.max_speed_mps, "robot maximum"

    def flat(value: Value) -> Value:
        return value.reshape(-1) if isinstance(value, np.ndarray) and value.ndim else value

    velocities = (
        None if velocities_mps is None else (flat(velocities_mps[0]), flat(velocities_mps[1]))
    )
    courses = courses_of(
        robot,
        basis,
        positions_m.reshape(-1, 2),
        flat(headings_rad),
        velocities,
        flat(yaw_rates_radps),
    )
    times = np.tile(np.arange(shape[1]), shape[0])
    flat_limits, flat_texts = limits.reshape(-1), texts.reshape(-1)
    for person in people_ahead(constraints, times_s, aware_for_s):
        off = np.hypot(_of(person.x_m, times) - courses.x_m, _of(person.y_m, times) - courses.y_m)
        near = np.flatnonzero(off < _free_m(person, courses, basis, robot) + reach_m)
        if not len(near):
            continue
        path, reach = person_limits_mps(
            person, courses.at(near), times[near], basis, robot, reach_m, fine
        )
        own = np.minimum(path, reach)
        if person.least_mps is not None:
            own = np.maximum(own, _of(person.least_mps, times[near]))
        own = (1.0 - _ROUNDING) * own
        lower = own < flat_limits[near]
        flat_limits[near[lower]] = own[lower]
        for rule, holds in (
            ("reach", lower & (reach <= path)),
            ("in the path", lower & (path < reach)),
        ):
            name = rule if person.least_mps is None else "lost"
            flat_texts[near[holds]] = f"track {person.track_id}: {name}"
    if basis.ceiling_mps is not None:
        rise_mps2 = 0.0 if constraints.stale else robot.max_acceleration_mps2
        ceilings = np.broadcast_to(basis.ceiling_mps + rise_mps2 * times_s, shape)
        texts[ceilings < limits] = "recovery after stale data"
        limits = np.minimum(limits, ceilings)
    if velocities_mps is not None and robot.moves_sideways is False:
        sideways = np.broadcast_to(np.abs(velocities_mps[1]) > LATERAL_NOISE_MPS, shape)
        limits[sideways] = 0.0
        texts[sideways] = "robot: moves sideways, but its profile says otherwise"
    if basis.stopped:
        limits[:], texts[:] = 0.0, "stale data"
    return limits, texts


def _of(value: Value, times: Any) -> Value:
    return value[times] if isinstance(value, np.ndarray) and value.ndim else value


def _free_m(person: PersonAhead, courses: Courses, basis: SpeedBasis, robot: RobotProfile) -> float:
    """Return a distance of person and base from which on the person sets no limit."""
    a, maximum = robot.max_deceleration_mps2, ROOM * robot.max_speed_mps
    elapsed_s, delay_s = float(np.max(person.elapsed_s)), float(np.max(person.delay_s))
    stop_s = robot.reaction_time_s + elapsed_s + maximum / a
    way_m = maximum * (robot.reaction_time_s + elapsed_s) + 0.5 * maximum**2 / a
    rules = basis.policy.reach
    tau = 1.0 if rules is None else rules.time_constant_s
    since_s = stop_s + maximum / a / STEPS + elapsed_s + delay_s
    walked_m = float(np.max(person.speed_mps)) * (since_s + tau * math.expm1(-since_s / tau))
    drift_m = max(tau, elapsed_s) * math.hypot(person.velocity_x_mps, person.velocity_y_mps)
    a0, a1, a2 = (max(float(np.max(each)), 0.0) for each in person.variances)
    uncertain_m = max(math.sqrt(a0 + tau * (a1 + tau * a2)), float(np.max(person.body_m)))
    driven_m = float(np.max(courses.driven_m)) + robot.circumscribed_radius_m
    # The drift between two steps, and that until the end.
    return way_m + walked_m + 2.0 * drift_m + uncertain_m + basis.policy.margins.floor_m + driven_m
