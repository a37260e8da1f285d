"""Poses of the robot as the speed field needs them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from shapely.geometry import MultiPoint
from shapely.geometry.polygon import orient

from .._governor import STANDING_MPS
from .._robot import LATERAL_NOISE_MPS, RobotProfile
from .._speed_basis import SpeedBasis
from ._field_arrays import ArrayLibrary

# Corners of a footprint that are this close to an upright rectangle make one.
_RECTANGLE_M: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Poses:
    """Poses of the robot and what is known of its motion there, arrays of one shape.

    Attributes:
        x: position relative to the reference point, in metres.
        y: the same.
        heading: cosine and sine of the heading, or None where it is not known.
        travel: unit vector of the direction of travel in the base frame, or None where the robot
            may drive in any direction or stand.
        turn: cosine and sine of the largest turn while the robot stops; needed with ``travel``.
        stands: whether the robot stands for the start reserve; needed with ``travel``.
        driven_m: how far the robot may have driven since its state.
        sideways: whether the robot drives sideways that cannot, or None for nowhere.
    """

    x: Any
    y: Any
    heading: tuple[Any, Any] | None = None
    travel: tuple[Any, Any] | None = None
    turn: tuple[Any, Any] | None = None
    stands: Any = None
    driven_m: Any = 0.0
    sideways: Any = None

    def along(self, forward_m: Any, left_m: Any) -> tuple[Any, Any]:
        """Return a place in the base frame along the direction of travel, and to its left."""
        assert self.travel is not None
        ahead_x, ahead_y = self.travel
        if isinstance(ahead_x, float):  # 1 or −1: all poses drive forward, or all backward
            return ahead_x * forward_m, ahead_x * left_m
        if isinstance(ahead_y, float):  # 0: nobody drives sideways
            return ahead_x * forward_m, ahead_x * left_m
        return (
            ahead_x * forward_m + ahead_y * left_m,
            ahead_x * left_m - ahead_y * forward_m,
        )

    def mapped(self, change: Callable[[Any], Any]) -> Poses:
        """Return the poses with ``change`` applied to each of their arrays."""

        def changed(value: Any) -> Any:
            if isinstance(value, tuple):
                return (changed(value[0]), changed(value[1]))
            return value if value is None or isinstance(value, float) else change(value)

        names = ("x", "y", "heading", "travel", "turn", "stands", "driven_m", "sideways")
        return replace(self, **{name: changed(getattr(self, name)) for name in names})


def poses_of(
    library: ArrayLibrary,
    basis: SpeedBasis,
    robot: RobotProfile,
    x: Any,
    y: Any,
    headings_rad: Any,
    velocities_base_mps: tuple[Any, Any] | None,
    yaw_rates_radps: Any,
) -> Poses:
    """Return poses and motion, as the speed governor judges them.

    Args:
        library: of the arrays.
        basis: the policy, and the age of the robot's state.
        robot: of the constraints.
        x: relative to the reference point, in metres.
        y: the same.
        headings_rad: in the odom frame, or None for any.
        velocities_base_mps: forward and left, or None for any.
        yaw_rates_radps: or None for any.
    """
    age_s = basis.robot_age_s
    heading = (
        None if headings_rad is None else (library.cos(headings_rad), library.sin(headings_rad))
    )
    if velocities_base_mps is None:
        return Poses(x, y, heading, driven_m=robot.max_speed_mps * age_s)
    forward_mps, left_mps = velocities_base_mps
    driven_m: Any = 0.0
    if left_mps is None:
        travel_mps, slips = abs(forward_mps), None
    else:
        travel_mps = library.sqrt(forward_mps * forward_mps + left_mps * left_mps)
        slips = _unless_none(abs(left_mps) > LATERAL_NOISE_MPS)
    if age_s > 0.0:
        fastest_mps = library.at_least(travel_mps, robot.max_speed_mps)
        faster_m = 0.5 * robot.max_acceleration_mps2 * age_s**2
        driven_m = library.minimum(travel_mps * age_s + faster_m, fastest_mps * age_s)
    sideways = slips if robot.moves_sideways is False else None
    if heading is None:
        return Poses(x, y, driven_m=driven_m, sideways=sideways)
    one = library.convert(1.0)
    # A robot that stands with a speed of −0 counts as driving backward, as in the adapter.
    backward = _unless_none(library.signbit(forward_mps))
    travel: tuple[Any, Any] = (1.0, 0.0)
    if backward is not None or slips is not None:
        travel = (library.where(library.signbit(forward_mps), -one, one), 0.0)
    if slips is not None:
        travel = (
            library.where(slips, forward_mps / travel_mps, travel[0]),
            library.where(slips, left_mps / travel_mps, 0.0 * one),
        )
    turn = _turn(library, basis, robot, velocities_base_mps, travel_mps, slips, yaw_rates_radps)
    stands = _unless_none(travel_mps < STANDING_MPS)
    return Poses(x, y, heading, travel, turn, stands, driven_m, sideways)


def _turn(
    library: ArrayLibrary,
    basis: SpeedBasis,
    robot: RobotProfile,
    velocities_base_mps: tuple[Any, Any],
    travel_mps: Any,
    slips: Any,
    yaw_rates_radps: Any,
) -> tuple[Any, Any]:
    """Return cosine and sine of the largest turn while the robot stops; −1 and 0 for any turn."""
    age_s = basis.robot_age_s
    forward_mps, left_mps = velocities_base_mps
    one = library.convert(1.0)
    turn_rad: Any = math.radians(basis.policy.rules.turn_within_stop_deg)
    anywhere = abs(forward_mps) < STANDING_MPS
    if slips is not None:
        anywhere = anywhere & ~slips
    if age_s > 0.0:
        # Without a yaw rate the robot may have turned by any angle.
        turn_rad = turn_rad + (math.pi if yaw_rates_radps is None else abs(yaw_rates_radps) * age_s)
        anywhere = anywhere | (travel_mps <= robot.max_acceleration_mps2 * age_s)
    if left_mps is not None and robot.moves_sideways is not False:
        # What counts as noise may be motion. The tangent is never below the angle.
        noise_rad = abs(left_mps) / library.at_least(abs(forward_mps), 1e-3)
        if slips is not None:
            noise_rad = library.where(slips, 0.0 * noise_rad, noise_rad)
        turn_rad = turn_rad + noise_rad
    turn: tuple[Any, Any]
    if isinstance(turn_rad, float):
        turned = turn_rad >= math.pi
        turn = (-1.0, 0.0) if turned else (math.cos(turn_rad), math.sin(turn_rad))
    else:
        anywhere = anywhere | (turn_rad >= math.pi)
        turn = (library.cos(turn_rad), library.sin(turn_rad))
    if bool(anywhere.any()):
        turn = (
            library.where(anywhere, -one, library.convert(turn[0])),
            library.where(anywhere, 0.0 * one, library.convert(turn[1])),
        )
    return turn


def _unless_none(mask: Any) -> Any:
    """Return a mask, or None if it holds nowhere."""
    return mask if bool(mask.any()) else None


class FootprintGaps:
    """Distances from a robot's footprint, for arrays of poses.

    Args:
        robot: with the footprint.
    """

    def __init__(self, robot: RobotProfile) -> None:
        hull = orient(MultiPoint(robot.footprint_m).convex_hull, 1.0)
        corners = np.asarray(hull.exterior.coords)[:-1]
        self._corners: Final[list[list[float]]] = corners.tolist()
        low, high = corners.min(axis=0), corners.max(axis=0)
        upright = np.minimum(abs(corners - low), abs(corners - high)).max() < _RECTANGLE_M
        self._middle: Final[list[float]] = (0.5 * (low + high)).tolist()
        self._half: Final[list[float]] = (0.5 * (high - low)).tolist()
        self._is_rectangle: Final = bool(upright) and len(corners) == 4
        self.radius_m: Final = robot.circumscribed_radius_m

    def distance_m(self, library: ArrayLibrary, forward_m: Any, left_m: Any) -> Any:
        """Return the distance of points in the base frame from the footprint, 0 inside."""
        if self._is_rectangle:
            beyond = library.at_least(abs(forward_m - self._middle[0]) - self._half[0], 0.0)
            beside = library.at_least(abs(left_m - self._middle[1]) - self._half[1], 0.0)
            return library.sqrt(beyond * beyond + beside * beside)
        gap2: Any = None
        inside: Any = None
        for (x, y), (end_x, end_y) in zip(
            self._corners, [*self._corners[1:], self._corners[0]], strict=True
        ):
            edge_x, edge_y = end_x - x, end_y - y
            to_x, to_y = forward_m - x, left_m - y
            along = (to_x * edge_x + to_y * edge_y) / (edge_x**2 + edge_y**2)
            along = 1.0 - library.at_least(1.0 - library.at_least(along, 0.0), 0.0)
            off_x, off_y = to_x - along * edge_x, to_y - along * edge_y
            squared = off_x * off_x + off_y * off_y
            gap2 = squared if gap2 is None else library.minimum(gap2, squared)
            is_left = edge_x * to_y >= edge_y * to_x
            inside = is_left if inside is None else inside & is_left
        return library.sqrt(library.where(inside, 0.0 * gap2, gap2))

    def in_path(
        self,
        library: ArrayLibrary,
        poses: Poses,
        along_m: Any,
        left_m: Any,
        body_m: Any,
        beside_m: float,
    ) -> Any:
        """Return whether a body reaches into the straight path, as a protective field has it.

        Args:
            library: of the arrays.
            poses: with the direction of travel.
            along_m: place of the body along the direction of travel.
            left_m: place to the left of it.
            body_m: radius of the body with its uncertainty.
            beside_m: supplement on either side.
        """
        assert poses.travel is not None
        one = library.convert(1.0)
        ahead_x, ahead_y = (library.convert(each) * one for each in poses.travel)
        rear: Any = None
        right: Any = None
        left: Any = None
        for x, y in self._corners:
            along, across = x * ahead_x + y * ahead_y, y * ahead_x - x * ahead_y
            rear = along if rear is None else library.minimum(rear, along)
            right = across if right is None else library.minimum(right, across)
            left = across if left is None else library.maximum(left, across)
        reach_m = body_m + beside_m
        return (left_m >= right - reach_m) & (left_m <= left + reach_m) & (along_m >= rear - body_m)
