"""Letting people who cross the robot's way pass first: early, and without a stop.

A robot that slows down only when it is near makes both hesitate. The person waits for the robot,
which then waits for the person. A robot that slows down early is there when they have passed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from perception.anthropometry import BODY_RADIUS_M

# The place of a person: their body and some room. It does not grow with unawareness as obstacles
# do, because a body that has left the way has left it.
_PLACE_M: Final = BODY_RADIUS_M + 0.20
# Whoever enters the way this much later than the robot has left the place is passed in front of.
_SPARE_S: Final = 0.5


@dataclass(frozen=True, slots=True)
class Way:
    """The strip that the robot drives through on its course, from its base origin.

    Attributes:
        bearing_rad: course in the base frame.
        length_m: length of the strip beyond the robot's front edge.
        half_width_m: half its width.
        front_m: from the base origin to the front edge of the robot.
        rear_m: from the base origin back to its rear edge.
    """

    bearing_rad: float
    length_m: float
    half_width_m: float
    front_m: float
    rear_m: float


def giving_way_mps(
    way: Way,
    people: Iterable[tuple[float, float, float, float]],
    top_mps: float,
    *,
    crossing_mps: float,
    within_s: float,
) -> float:
    """Return the highest speed, up to ``top_mps``, that lets crossing people pass first.

    At this speed the robot's front edge is before the place of each person, a disc of 0.5 m, for as
    long as that is in the way, if everybody goes on at constant velocity.

    Args:
        way: of the robot.
        people: x, y, vx, vy of each, in the base frame.
        top_mps: speed of the robot otherwise, > 0.
        crossing_mps: people who are slower than this across the way do not count, since they may
            be waiting for the robot.
        within_s: people who enter the way later do not count.
    """
    c, s = math.cos(way.bearing_rad), math.sin(way.bearing_rad)
    speed_mps = top_mps
    for x, y, vx, vy in people:
        along_m, across_m = c * x + s * y, c * y - s * x
        along_mps, across_mps = c * vx + s * vy, c * vy - s * vx
        if abs(across_mps) < crossing_mps:
            continue
        half_m = math.copysign(way.half_width_m + _PLACE_M, across_mps)
        enters_s = max((-half_m - across_m) / across_mps, 0.0)
        leaves_s = (half_m - across_m) / across_mps
        if leaves_s <= 0.0 or enters_s > within_s:
            continue
        ends_m = (along_m + along_mps * enters_s, along_m + along_mps * leaves_s)
        room_m = min(ends_m) - _PLACE_M - way.front_m
        if not 0.0 < room_m < way.length_m:
            continue  # beside or behind the robot, or beyond its goal
        passed_m = max(ends_m) + _PLACE_M + way.rear_m
        if passed_m / top_mps + _SPARE_S > enters_s:
            speed_mps = min(speed_mps, room_m / leaves_s)
    return speed_mps
