"""Courses: where a robot may be while it stops, and where on them it meets the reach of a person.

A course is written once, for one robot on plain floats and for many at once on arrays: functions
take the mathematics of either (``xp``, :class:`Floats` or NumPy). Contacts are computed some twenty
times per person and update, so those of floats are written out here.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

from ._robot import LATERAL_NOISE_MPS, RobotProfile
from .reach import Reach
from .rigid import Motion

#: Below this speed the robot counts as standing: it may start either way.
STANDING_MPS: Final = 0.05
#: The room above the robot's maximum up to which limits are computed: with it, a limit of the
#: fastest point of a robot that turns is higher than the maximum.
ROOM: Final = 1.5
# A person at the base origin has no direction.
_SAME_PLACE_M: Final = 1e-9
_sqrt, _expm1 = math.sqrt, math.expm1


class Floats:
    """The mathematics of plain floats under NumPy's names."""

    absolute, minimum, maximum = abs, min, max
    cos, sin, hypot, arctan2 = math.cos, math.sin, math.hypot, math.atan2

    @staticmethod
    def where(condition: bool, this: float, other: float) -> float:
        """Return one of two floats."""
        return this if condition else other


class Course(NamedTuple):
    """The courses that a robot may take while it stops, as a fan of straight ways.

    A robot on a curve is within the fan too: the chord of its arc lies between the courses, and the
    rectangle is larger by what the turn about that chord swings out. Values are floats, or arrays
    of one number per robot.

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
        maximum_mps: highest speed of the robot, with room above it.
        deceleration_mps2: a > 0.
        reaction_s: T ≥ 0.
    """

    x_m: Any
    y_m: Any
    cos: Any
    sin: Any
    fan_cos: Any
    fan_sin: Any
    front_m: Any
    rear_m: Any
    half_m: Any
    radius_m: Any
    circle_m: float
    maximum_mps: float
    deceleration_mps2: float
    reaction_s: float

    def grown(self, clearance_m: float) -> Course:
        """Return the course of a robot that is larger by this ahead and on either side."""
        return self._replace(
            front_m=self.front_m + clearance_m,
            half_m=self.half_m + clearance_m,
            radius_m=self.radius_m + math.sqrt(2.0) * clearance_m,
        )

    def turned(self, turn_rad: float, xp: Any = Floats) -> Course:
        """Return the courses turned by up to this off these, either way."""
        fan_rad = xp.minimum(xp.arctan2(self.fan_sin, self.fan_cos) + turn_rad, math.pi)
        return self._replace(fan_cos=xp.cos(fan_rad), fan_sin=xp.sin(fan_rad))


def course_of(
    robot: RobotProfile, motion: Motion, turn_rad: float, age_s: float = 0.0, xp: Any = Floats
) -> Course:
    """Return the courses along the direction of travel of a robot whose motion is ``age_s`` old.

    It turns by at most ``turn_rad`` off the curve that it drives; 0 is the robot's own motion. The
    footprint is measured along the course. A robot that stands starts forwards.
    """
    forward, left = motion.forward_mps, motion.left_mps
    sideways = xp.absolute(left) > LATERAL_NOISE_MPS
    speed = xp.where(sideways, xp.hypot(forward, left), xp.absolute(forward))
    off_rad = travel_bearing_rad(forward, left, xp)
    noise_rad = 0.0
    if robot.moves_sideways is not False:
        # What counts as noise may be motion.
        noise_rad = xp.arctan2(xp.absolute(left), xp.maximum(speed, STANDING_MPS))
        noise_rad = xp.where(sideways, 0.0, noise_rad)
    # On its curve the robot turns by an angle until it stands. The chord has up to half of it, and
    # the heading up to half of it more than the chord.
    stopping_s = robot.reaction_time_s + age_s + 0.5 * speed / robot.max_deceleration_mps2
    turned_rad = motion.yaw_rate_radps * stopping_s
    half_rad = 0.5 * xp.minimum(xp.maximum(turned_rad, -math.pi), math.pi)
    swing_rad = xp.absolute(half_rad) + noise_rad
    fan_rad = xp.minimum(turn_rad + noise_rad + 0.5 * xp.absolute(half_rad), math.pi)
    middle_rad = motion.heading_rad + off_rad + 0.5 * half_rad
    front_m, rear_m, half_m = extent_m(robot, off_rad, swing_rad, xp)
    driven_m = driven_since_m(robot, xp.hypot(forward, left), age_s, xp)
    return Course(
        *(motion.x_m, motion.y_m, xp.cos(middle_rad), xp.sin(middle_rad)),
        *(xp.cos(fan_rad), xp.sin(fan_rad), front_m + driven_m, rear_m, half_m),
        *(robot.circumscribed_radius_m + driven_m, 0.0, ROOM * robot.max_speed_mps),
        *(robot.max_deceleration_mps2, robot.reaction_time_s),
    )


def travel_bearing_rad(forward_mps: Any, left_mps: Any, xp: Any = Floats) -> Any:
    """Return the direction of travel from the base; ahead for a robot that stands.

    Less sideways motion than 0.1 m/s is taken for noise.
    """
    ahead_rad = xp.where(forward_mps <= -STANDING_MPS, math.pi, 0.0)
    sideways = xp.absolute(left_mps) > LATERAL_NOISE_MPS
    return xp.where(sideways, xp.arctan2(left_mps, forward_mps), ahead_rad)


def stands_still(motion: Motion) -> bool:
    """Return whether a robot stands, so that it may start in any direction that its drive can."""
    return abs(motion.left_mps) <= LATERAL_NOISE_MPS and abs(motion.forward_mps) < STANDING_MPS


def starts_of(robot: RobotProfile, motion: Motion, turn_rad: float, age_s: float = 0.0) -> Course:
    """Return the courses on which a robot that stands may start otherwise than forwards.

    They lead backwards, or in all directions if it may be able to move sideways: its circle counts.
    """
    if robot.moves_sideways is False:
        backwards = motion._replace(forward_mps=-STANDING_MPS, left_mps=0.0)
        return course_of(robot, backwards, turn_rad, age_s)
    course = course_of(robot, motion, math.pi, age_s)
    driven_m = course.radius_m - robot.circumscribed_radius_m
    return course._replace(
        front_m=driven_m, rear_m=0.0, half_m=0.0, circle_m=robot.circumscribed_radius_m
    )


def extent_m(
    robot: RobotProfile, off_rad: Any, swing_rad: Any, xp: Any = Floats
) -> tuple[Any, Any, Any]:
    """Return front, rear and half the width along a course ``off_rad`` from the heading.

    They hold the footprint turned by up to ``swing_rad`` about that course, either way.
    """
    cos, sin = xp.cos(off_rad), xp.sin(off_rad)
    front, rear, half = -math.inf, math.inf, 0.0
    for x, y in robot.footprint_m.tolist():
        along, across = cos * x + sin * y, cos * y - sin * x
        front, rear = xp.maximum(front, along), xp.minimum(rear, along)
        half = xp.maximum(half, xp.absolute(across))
    radius = robot.circumscribed_radius_m
    swing_rad = xp.minimum(swing_rad, 0.5 * math.pi)
    cos, sin = xp.cos(swing_rad), xp.sin(swing_rad)
    long = xp.maximum(front, -rear)
    wide = xp.minimum(half * cos + long * sin, radius)
    return (
        xp.minimum(front + half * sin, radius),
        xp.maximum(rear - half * sin, -radius),
        # A corner that has swung past the side was out at the radius.
        xp.where(half * sin < long * cos, wide, radius),
    )


def driven_since_m(robot: RobotProfile, travel_mps: Any, age_s: float, xp: Any = Floats) -> Any:
    """Return how far a robot may have driven since its state, speeding up to its maximum."""
    fastest_mps = xp.maximum(travel_mps, robot.max_speed_mps)
    faster_m = 0.5 * robot.max_acceleration_mps2 * age_s**2
    return xp.minimum(travel_mps * age_s + faster_m, fastest_mps * age_s)


def reach_at(
    person: Reach, course: Course, t0_s: float, t1_s: float
) -> tuple[float, float, float, float, float]:
    """Return the middle of the reach from t0 to t1, its squared distance, radius, and margin.

    The middle is given along and across the middle of the fan, as seen from the base.
    """
    # The formulas of Reach.
    x_m, y_m, vx, vy, U, tau, delay_s, elapsed_s, margin, within, terms, *memory = person
    until_s, later, keeps_s = memory
    a0, a1, a2 = terms
    base_x, base_y, cos, sin = course[:4]
    old0_s, old1_s = t0_s + elapsed_s, t1_s + elapsed_s
    kept0_s, kept1_s = min(old0_s, keeps_s), min(old1_s, keeps_s)
    m0 = tau * -_expm1((kept0_s - old0_s) / tau)
    m1 = tau * -_expm1((kept1_s - old1_s) / tau)
    since_s = old1_s + delay_s
    drift0_s, drift1_s = kept0_s + m0, kept1_s + m1
    middle_s = 0.5 * (drift0_s + drift1_s)
    dx = x_m + vx * middle_s - base_x
    dy = y_m + vy * middle_s - base_y
    x, y = cos * dx + sin * dy, abs(cos * dy - sin * dx)
    reach = U * (since_s + tau * _expm1(-since_s / tau))
    if since_s > until_s:
        aware = U * (until_s + tau * _expm1(-until_s / tau))
        margin -= within if aware > within else aware
        late_s = since_s - until_s
        reach += max(later - U, 0.0) * (late_s + tau * _expm1(-late_s / tau))
    else:
        margin -= within if reach > within else reach
    reach += 0.5 * (drift1_s - drift0_s) * _sqrt(vx * vx + vy * vy)
    # With a negative a1 it shrinks.
    variance = max(a0 + m1 * (a1 + m1 * a2), a0 + m0 * (a1 + m0 * a2))
    if not variance <= 0.0:
        reach += _sqrt(variance)
    return x, y, x * x + y * y, reach, margin


def contact_m(
    course: Course, x: float, y: float, distance2: float, reach: float, margin: float
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
    if low_y < 0.0:  # not 0: somebody exactly behind has that too
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
