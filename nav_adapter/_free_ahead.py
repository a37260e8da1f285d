"""Twists that nobody slows down within the next cycles: an answer in plain numbers, or none."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import FloatArray

from ._constraints import NavConstraints
from ._people_ahead import PersonAhead, people_ahead
from ._policy import AwarenessPolicy
from ._robot import LATERAL_NOISE_MPS, RobotProfile, RobotState
from ._speed_basis import SpeedBasis
from .limit import (
    STANDING_MPS,
    Course,
    any_course_of,
    course_of,
    in_the_path_mps,
    limit_mps,
    straight_course_of,
)
from .reach import Reach

# The field computes in single precision, so it adds to every reach what rounding is worth there: at
# most this much, while the data are this young and nobody is farther from the robot than this.
_ROUNDING_M: Final = 0.01
_YOUNG_S: Final = 1.0
_FARTHEST_M: Final = 45.0
# And it lowers a limit by less than this.
_ROUNDING_MPS: Final = 1e-3


def is_free_ahead(
    constraints: NavConstraints,
    robot_state: RobotState,
    twist: list[float],
    slack_mps: float,
    times_s: FloatArray,
) -> bool:
    """Return whether nobody sets a limit at these times that a twist does not keep anyway.

    It asks for one speed what :func:`~nav_adapter.exporters.speed_limit_at` works out, with a
    margin: True is always right, and takes a tenth of the time.
    """
    basis, robot = constraints.speed_basis, constraints.robot
    if basis is None or robot is None or basis.stopped or basis.ceiling_mps is not None:
        return False
    forward, left, yaw_rate = twist[0], (twist[1] if len(twist) == 3 else 0.0), twist[-1]
    present = robot_state.speed_mps, robot_state.lateral_mps, robot_state.yaw_rate_radps
    if robot.moves_sideways is False and max(abs(left), abs(present[1])) > LATERAL_NOISE_MPS:
        return False
    first_s, last_s = float(times_s[0]), float(times_s[-1])
    still_mps = robot_state.travel_mps - robot.max_deceleration_mps2 * first_s
    needed_mps = max(math.hypot(forward, left), still_mps) + slack_mps
    needed_mps += robot.circumscribed_radius_m * abs(yaw_rate)
    needed_mps = min(needed_mps, robot.max_speed_mps) + _ROUNDING_MPS
    middle_s, half_s = 0.5 * (first_s + last_s), 0.5 * (last_s - first_s)
    motions: list[_MotionAhead] = []
    stop_s = (
        robot.reaction_time_s + _YOUNG_S + 1.2 * robot.max_speed_mps / robot.max_deceleration_mps2
    )
    robot_m = robot.max_speed_mps * stop_s + 2.0 * robot.circumscribed_radius_m
    for person in people_ahead(constraints, times_s, math.inf):
        allows = person.least_mps is not None and float(np.min(person.least_mps)) >= needed_mps
        for reach in person.reaches(len(times_s)):
            farthest_m = robot_m + float(np.max(person.body_m))
            if basis.policy.reach is not None:
                farthest_m += reach.farthest_m(stop_s)
            if reach.elapsed_s > _YOUNG_S or farthest_m > _FARTHEST_M:
                return False
            if allows:
                continue
            motions = motions or [
                _MotionAhead.of(basis, robot, robot_state, velocity, middle_s, half_s)
                for velocity in ((forward, left, yaw_rate), present)
            ]
            if not all(motion.keeps(needed_mps, person, reach, basis.policy) for motion in motions):
                return False
    return True


class _MotionAhead(NamedTuple):
    """The courses of a robot that keeps one motion over some time ahead, from anywhere on its way.

    Attributes:
        straight: those of a robot that goes straight on.
        course: those that count for the reach; None under a policy that knows no motion.
        margin_m: places of people are larger by this, since the base is not at one place.
        turned_rad: the robot turns by at most this much either way.
    """

    straight: Course
    course: Course | None
    margin_m: float
    turned_rad: float

    @classmethod
    def of(
        cls,
        basis: SpeedBasis,
        robot: RobotProfile,
        robot_state: RobotState,
        velocity: tuple[float, float, float],
        middle_s: float,
        half_s: float,
    ) -> _MotionAhead:
        """Return the courses of a base velocity x, y, ω from ``half_s`` before a time to after."""
        vx, vy, yaw_rate = velocity
        half_rad = 0.5 * yaw_rate * middle_s
        chord_s = middle_s * (math.sin(half_rad) / half_rad if half_rad else 1.0)
        heading = robot_state.heading_odom_rad + half_rad
        c, s = chord_s * math.cos(heading), chord_s * math.sin(heading)
        moved = np.array([c * vx - s * vy, s * vx + c * vy])
        state = RobotState(
            robot_state.stamp_s,
            robot_state.position_odom_m + moved,
            heading + half_rad,
            vx,
            yaw_rate,
            np.array([vx, vy]),
        )
        age_s, turned_rad = basis.robot_age_s, abs(yaw_rate) * half_s
        course, rules = None, basis.policy.reach
        if rules is not None and abs(vx) < STANDING_MPS and abs(vy) <= LATERAL_NOISE_MPS:
            course = any_course_of(robot, state, age_s)
        elif rules is not None:
            course = course_of(robot, state, math.radians(rules.turn_deg) + turned_rad, age_s)
        straight = straight_course_of(robot, state, age_s)
        straight = straight._replace(fan_cos=math.cos(turned_rad), fan_sin=math.sin(turned_rad))
        return cls(straight, course, state.travel_mps * half_s + _ROUNDING_M, turned_rad)

    def keeps(
        self, speed_mps: float, person: PersonAhead, reach: Reach, policy: AwarenessPolicy
    ) -> bool:
        """Return whether a person sets no limit below a speed, who has one of their reaches."""
        straight, margins = self.straight, policy.margins
        aged = straight._replace(reaction_s=straight.reaction_s + reach.elapsed_s)
        margin_m = reach.margin_m + self.margin_m
        body_m = float(np.max(person.body_m)) + margin_m
        for after_s in {0.0, reach.elapsed_s}:
            x = reach.x_m + after_s * reach.velocity_x_mps
            y = reach.y_m + after_s * reach.velocity_y_mps
            turned_m = self.turned_rad * math.hypot(x - straight.x_m, y - straight.y_m)
            path_mps = in_the_path_mps((x, y), body_m + turned_m, margins.clearance_m, aged)
            if path_mps < speed_mps:
                return False
        if self.course is None:
            return True
        reach = reach._replace(margin_m=margins.floor_m + margin_m)
        if limit_mps(reach, self.course, speed_mps) < speed_mps:
            return False
        # Whoever walks on is not met by a robot that goes straight on.
        return not person.walks_faster or (
            limit_mps(reach.walking_on(), straight, speed_mps) >= speed_mps
        )
