"""Contact of the robot with the reach of a person: geometry on plain floats, for the limit alone.

It is computed some twenty times per person and update, so its formulas are written out.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from .reach import Reach

# A person at the base origin has no direction.
_SAME_PLACE_M: Final = 1e-9
_sqrt, _expm1 = math.sqrt, math.expm1


class Course(NamedTuple):
    """The courses that a robot may take while it stops, as a fan of straight ways.

    A robot on a curve is within the fan too: the chord of its arc lies between the courses, and the
    rectangle is larger by what the turn about that chord swings out.

    Attributes:
        x_m: place of the base in odom.
        y_m: the same.
        cos: direction of the middle of the fan.
        sin: the same.
        fan_cos: half the opening of the fan.
        fan_sin: the same.
        front_m: farthest part of the footprint ahead of the base, along the course.
        rear_m: the same behind it, mostly negative.
        half_m: half the width.
        radius_m: no part of the robot is farther from the base of its course, wherever it points.
        circle_m: radius of a robot that may go anywhere at once, as a circle; 0 for a fan.
        maximum_mps: highest speed of the robot.
        deceleration_mps2: a > 0.
        reaction_s: T ≥ 0.
    """

    x_m: float
    y_m: float
    cos: float
    sin: float
    fan_cos: float
    fan_sin: float
    front_m: float
    rear_m: float
    half_m: float
    radius_m: float
    circle_m: float
    maximum_mps: float
    deceleration_mps2: float
    reaction_s: float


def reach_at(
    person: Reach, course: Course, t0_s: float, t1_s: float
) -> tuple[float, float, float, float]:
    """Return the middle of the reach from t0 to t1, its squared distance, and its radius.

    The middle is given along and across the middle of the fan, as seen from the base.
    """
    # The formulas of Reach.
    x_m, y_m, vx, vy, U, tau, delay_s, elapsed_s, _, (a0, a1, a2) = person
    base_x, base_y, cos, sin = course[:4]
    m0 = tau * -_expm1(-(t0_s + elapsed_s) / tau)
    m1 = tau * -_expm1(-(t1_s + elapsed_s) / tau)
    since_s = t1_s + elapsed_s + delay_s
    middle_s = 0.5 * (m0 + m1)
    dx = x_m + vx * middle_s - base_x
    dy = y_m + vy * middle_s - base_y
    x, y = cos * dx + sin * dy, abs(cos * dy - sin * dx)
    reach = U * (since_s + tau * _expm1(-since_s / tau))
    reach += 0.5 * (m1 - m0) * _sqrt(vx * vx + vy * vy)
    # With a negative a1 it shrinks.
    variance = max(a0 + m1 * (a1 + m1 * a2), a0 + m0 * (a1 + m0 * a2))
    if not variance <= 0.0:
        reach += _sqrt(variance)
    return x, y, x * x + y * y, reach


def contact_m(
    course: Course, margin: float, x: float, y: float, distance2: float, reach: float
) -> tuple[float, float, float]:
    """Return the ways on which the robot meets a reach at (x, y) along and across the fan's middle.

    The first two numbers are the ends of an interval, with the person ahead; it is empty, (∞, −∞),
    where there is none. The third is the end of one that begins before the robot, with the person
    behind the base, or −∞. A body behind the rear edge does not count: the robot drives away.
    """
    _, _, _, _, cos, sin, front, rear, half, radius, circle = course[:11]
    rho, side = reach + margin, half + margin
    distance = _sqrt(distance2)
    if not (distance > _SAME_PLACE_M and reach >= 0.0):  # at the base, or NaN
        return -math.inf, math.inf, math.inf
    if circle > 0.0:  # straight to the person
        return distance - circle - front - rho, math.inf, -math.inf
    # Seen from the courses of the fan, the middle of the reach lies on an arc about the base, from
    # the course nearest to it to the one farthest from it. The ends of the arc, and the point to
    # which a corner of the footprint leads straight, hold the least and the largest way.
    low_x, low_y = cos * x + sin * y, cos * y - sin * x
    if low_y <= 0.0:
        low_x, low_y = distance, 0.0
    high_x, high_y = cos * x - sin * y, cos * y + sin * x
    if high_y < 0.0:
        high_x, high_y = -distance, 0.0
    near, past, past_behind = math.inf, -math.inf, -math.inf
    if low_x >= 0.0 and low_y < half + rho:
        off = low_y - side
        past = low_x - rear + (_sqrt(reach * reach - off * off) if off > 0.0 else reach)
        at, beyond = max(high_x, 0.0), distance - rho
        if beyond > half:
            share = half / beyond
            at = max(at, distance * _sqrt(1.0 - share * share))
        at = min(at, low_x)
        off = _sqrt(max(distance2 - at * at, 0.0)) - half
        near = at - front - (_sqrt(max(rho * rho - off * off, 0.0)) if off > 0.0 else rho)
        near = max(near, distance - radius - rho)
    if high_x < 0.0 and high_y < half + rho and distance <= radius + rho:
        at, beyond = min(low_x, 0.0), distance - reach
        if beyond > side:
            share = side / beyond
            at = min(at, -distance * _sqrt(1.0 - share * share))
        at = max(at, high_x)
        off = _sqrt(max(distance2 - at * at, 0.0)) - side
        past_behind = at - rear
        past_behind += _sqrt(max(reach * reach - off * off, 0.0)) if off > 0.0 else reach
    if past < 0.0:
        near, past = math.inf, -math.inf
    return near, past, past_behind
