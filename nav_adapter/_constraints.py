"""Obstacles and a speed limit, as the adapter hands them to a local planner."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from perception.arrays import (
    FloatArray,
    covariance_matrix,
    finite_array,
    finite_number,
    set_fields,
)
from perception.short_repr import short_repr

from ._errors import NavError
from ._known import SpeedBasis
from ._robot import RobotProfile
from .alerts import Alert, Answer

_SIDES: Final = 24
_ANGLES = np.arange(_SIDES) * (2.0 * math.pi / _SIDES)
# Scaled so that the sides, not the corners, touch the circle: the polygon contains it.
_UNIT_POLYGON = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1) / math.cos(math.pi / _SIDES)


@dataclass(frozen=True, eq=False, repr=False)
class PersonObstacle:
    """One person as an obstacle in the odom frame.

    Attributes:
        track_id: id of the person's track.
        center_odom_m: (2,).
        velocity_odom_mps: (2,).
        radius_m: > 0, including body, clearance and the inflation that depends on awareness.
        height_m: > 0.
        awareness_lower: the lower bound of α that was used, in [0, 1]; 0 for people whose α is not
            trusted. When it falls the radius grows at once; when it rises the radius shrinks at a
            bounded rate.
        polygon: shapely, in odom: the circle as a polygon that contains it.
        covariance_odom: (4, 4) covariance of the position (m) and the velocity (m/s) of the track,
            predicted to the stamp of the constraints with constant velocity; None if it is not
            known.
    """

    track_id: int
    center_odom_m: FloatArray
    velocity_odom_mps: FloatArray
    radius_m: float
    height_m: float
    awareness_lower: float
    polygon: Polygon = field(repr=False)
    covariance_odom: FloatArray | None = field(default=None, repr=False)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        def positive(name: str) -> float:
            return finite_number(
                name, getattr(self, name), NavError, minimum=0.0, exclusive_minimum=True
            )

        set_fields(
            self,
            center_odom_m=finite_array("center_odom_m", self.center_odom_m, (2,), NavError),
            velocity_odom_mps=finite_array(
                "velocity_odom_mps", self.velocity_odom_mps, (2,), NavError
            ),
            radius_m=positive("radius_m"),
            height_m=positive("height_m"),
            awareness_lower=finite_number(
                "awareness_lower", self.awareness_lower, NavError, minimum=0.0, maximum=1.0
            ),
        )
        if self.covariance_odom is not None:
            covariance = covariance_matrix("covariance_odom", self.covariance_odom, 4, NavError)
            set_fields(self, covariance_odom=covariance)

    def __getattr__(self, name: str) -> Any:
        # Called for what is not set: the polygon of the adapter's obstacles, which many planners
        # never ask for.
        if name != "polygon":
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        polygon = shapely.polygons(self.center_odom_m + self.radius_m * _UNIT_POLYGON)
        set_fields(self, polygon=polygon)
        return polygon


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NavConstraints:
    """Obstacles and a speed limit for one planning cycle.

    Attributes:
        stamp_s: the time that they hold for.
        obstacles: one per person.
        speed_limit_mps: ≥ 0; 0 means stop.
        limited_by: the person and the rule (:mod:`nav_adapter.rules`) that set the limit, such as
            ``"track 3: reach"`` or ``"track 3: in the path"`` (the protective field of a scanner);
            what else stops or slows the robot; or ``"robot maximum"``.
        stale: True if the data are too old to trust; everyone then counts as unaware.
        reachable_speed_limit_mps: the limit that the robot can follow from its present speed with
            its full deceleration. It equals ``speed_limit_mps`` (and is never below it) unless the
            limit fell faster than the robot can brake. For planners whose window of reachable
            speeds must not be empty. It starts from the measured speed, so a drive with its own
            ramp should get ``speed_limit_mps``: following a late measurement brakes too softly.
        alerts: people to warn now, and then the person to ask for attention, if any. An alert is
            given once, not in every update, and none by the watchdog.
        braking_suffices: False if a robot that brakes from now on at full deceleration may still be
            met before it stands, by the model of people. A limit is then not enough: warn, evade or
            stop harder.
        fastest_point_limit_mps: the limit for the fastest point of a robot that turns, such as a
            corner of its footprint. It is ``speed_limit_mps`` where people set the limit. Where the
            robot's own maximum does, it is higher, and infinite if nobody is near. If it is not
            given, it is ``speed_limit_mps``.
        other_way_limit_mps: the limit, for the fastest point, of going another way than
            ``speed_limit_mps`` is for, which is that of the robot's motion, or forwards for a robot
            that stands. Backwards or sideways from a stand, people there count, and so they do if
            the robot turns on the spot. Otherwise it is 0: the robot must stand first. Infinite if
            nobody is near, and for constraints made by hand.
        robot: the profile that they hold for; None if they were made without an adapter.
        speed_basis: what the limit was computed from, for
            :func:`nav_adapter.exporters.speed_limit_at`; None for constraints made by hand.
        answers: people who were asked for attention and have just looked, each once.
    """

    stamp_s: float
    obstacles: tuple[PersonObstacle, ...]
    speed_limit_mps: float
    limited_by: str
    stale: bool
    reachable_speed_limit_mps: float = 0.0
    alerts: tuple[Alert, ...] = ()
    braking_suffices: bool = True
    fastest_point_limit_mps: float | None = field(default=None, repr=False)
    robot: RobotProfile | None = field(default=None, repr=False)
    speed_basis: SpeedBasis | None = field(default=None, repr=False)
    answers: tuple[Answer, ...] = ()
    other_way_limit_mps: float = field(default=math.inf, repr=False)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        limit = finite_number("speed_limit_mps", self.speed_limit_mps, NavError, minimum=0.0)
        reachable = finite_number(
            "reachable_speed_limit_mps", self.reachable_speed_limit_mps, NavError, minimum=0.0
        )
        set_fields(
            self,
            stamp_s=finite_number("stamp_s", self.stamp_s, NavError),
            obstacles=tuple(self.obstacles),
            speed_limit_mps=limit,
            reachable_speed_limit_mps=max(limit, reachable),
            alerts=tuple(self.alerts),
            answers=tuple(self.answers),
            fastest_point_limit_mps=self._checked_fastest_mps(limit),
        )

    def _checked_fastest_mps(self, limit_mps: float) -> float:
        """Return the limit of the fastest point, which may be infinite."""
        given = self.fastest_point_limit_mps
        if given is None or given == math.inf:
            return limit_mps if given is None else math.inf
        return max(limit_mps, finite_number("fastest_point_limit_mps", given, NavError))

    def yaw_rate_limit_radps(self, speed_mps: float) -> float:
        """Return the largest yaw rate, either way, at which no point of the robot is too fast.

        A point at a distance r from the base origin moves at most at |v| + |ω| r. The farthest
        point is at the circumscribed radius R, so |v| + |ω| R ≤ ``fastest_point_limit_mps`` holds
        for every point if it holds there. This is assumption 4 of ``docs/safety.md``. The profile's
        ``max_yaw_rate_radps`` and |v| / ``min_turning_radius_m`` are upper limits, where they are
        given.

        Args:
            speed_mps: speed of the base along its path, of either sign.

        Returns:
            A yaw rate ≥ 0; 0 if the speed uses the limit up, and infinite if neither people nor
            the profile limit it.

        Raises:
            NavError: for a speed that is not finite, or constraints without ``robot``.
        """
        speed = abs(finite_number("speed_mps", speed_mps, NavError))
        assert self.fastest_point_limit_mps is not None
        left_mps = self.fastest_point_limit_mps - speed
        if left_mps <= 0.0:
            return 0.0
        if self.robot is None:
            raise NavError(
                "yaw_rate_limit_radps needs constraints with a robot, as NavAdapter.update gives "
                "them; these have robot=None"
            )
        limits = [left_mps / self.robot.circumscribed_radius_m]
        if self.speed_basis is not None and self.speed_basis.stands:
            other_mps = max(self.other_way_limit_mps - speed, 0.0)
            straight = max(speed_mps, 0.0) / self.robot.half_width_m
            limits.append(max(other_mps / self.robot.circumscribed_radius_m, straight))
        if self.robot.max_yaw_rate_radps is not None:
            limits.append(self.robot.max_yaw_rate_radps)
        if self.robot.min_turning_radius_m is not None:
            limits.append(speed / self.robot.min_turning_radius_m)
        return min(limits)
