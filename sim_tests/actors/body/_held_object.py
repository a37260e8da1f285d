"""What a worker holds or sits on: a cardboard box, a phone, a seat."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, Protocol, get_args

import numpy as np

from perception.arrays import FloatArray

from ...world.errors import SimError
from ...world.hall import Mesh, box, merge
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface, TriangleSet
from ._postures import BOX_SIZE_M, PHONE_SIZE_M, seated_pose
from ._quaternions import Vector
from ._skeleton import Skeleton

SeatKind = Literal["stool", "box"]

_MEAN_STATURE_M: Final = 1.75
# One texel per colour: cardboard, tape, phone, its screen; wood for seats is cardboard's.
_PALETTE: Final = np.array(
    [[[176, 136, 92], [206, 184, 142], [28, 28, 32], [150, 190, 220]]], dtype=np.uint8
).repeat(4, axis=0)
_CARDBOARD_UV, _TAPE_UV, _PHONE_UV, _SCREEN_UV = ((0.125 + 0.25 * k, 0.5) for k in range(4))
# The seat for a body of 1.75 m: depth and width, and its middle ahead of the hips.
_SEAT_DEPTH_M: Final = 0.34
_SEAT_WIDTH_M: Final = 0.42
_SEAT_AHEAD_M: Final = 0.03
# From the hip joints down to the seat, at 1.75 m.
_HIPS_ABOVE_SEAT_M: Final = 0.115
# Boards of a seat as shares of its height, how far those of a box stand out, and a stool's legs as
# a share of its width.
_BOARD_SHARE: Final = 0.12
_BOARD_M: Final = 0.006
_LEG_SHARE: Final = 0.1
_TAPE_WIDTH_M: Final = 0.05
# Radius of a sphere that holds either object in the hands.
_REACH_M: Final = 0.5 * float(np.linalg.norm(BOX_SIZE_M))


@dataclass(frozen=True, slots=True)
class Seat:
    """A seat, which stands on the floor.

    Attributes:
        kind: a stool with four legs, or a closed box, which hides the legs behind it.
        size_m: depth, width and height.
    """

    kind: SeatKind
    size_m: Vector


class Holder(Protocol):
    """A body that may hold an object or sit on one; :class:`Worker` is one."""

    @property
    def held(self) -> str | None:
        """The object in the hands, or the seat; None for neither."""
        ...

    @property
    def seat(self) -> Seat:
        """The seat that the body takes when seated."""
        ...

    @property
    def T_odom_held(self) -> FloatArray | None:  # noqa: N802
        """(4, 4) pose of the object; None with empty hands."""
        ...

    @property
    def chest_odom_m(self) -> FloatArray:
        """(3,) middle of the chest."""
        ...

    def reach_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the body."""
        ...


class HeldObject:
    """The visual actor of the object that a :class:`Worker` holds or sits on.

    It is separate from the person's actor, so that a box hides the chest behind it.

    Args:
        worker: the person who holds it.

    Attributes:
        kind: ``"prop"``.
    """

    kind = "prop"

    def __init__(self, worker: Holder) -> None:
        self._worker = worker
        self._bodies: dict[str, int] = {}

    def bounds_odom_m(self) -> FloatArray:
        """Return (2, 3) the corners of a box that holds the object; a point with empty hands."""
        place = self._worker.T_odom_held
        if place is None:
            return np.array([self._worker.chest_odom_m] * 2)
        reach = _REACH_M
        if self._worker.held == "seat":
            reach = 0.5 * float(np.linalg.norm(self._worker.seat.size_m)) + _BOARD_M
        return np.array([place[:3, 3] - reach, place[:3, 3] + reach])

    def reach_odom_m(self) -> FloatArray:
        """Return the worker's reach; a point with empty hands."""
        reach = self._worker.reach_odom_m()
        return reach if self._worker.held is not None else np.array([reach[0], reach[0]])

    def surface(self, detail: int) -> PlacedSurface | None:
        """Return the object's surface; None with empty hands. All levels of detail are the same."""
        held, place = self._worker.held, self._worker.T_odom_held
        if held is None or place is None:
            return None
        return PlacedSurface(_triangles(held, self._seat(held)), place[None])

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[list[int], FloatArray]:
        """Return the object, made when it is first held; all levels of detail are the same."""
        held, place = self._worker.held, self._worker.T_odom_held
        if held is None or place is None:
            return [], np.empty((0, 4, 4))
        if held not in self._bodies:
            self._bodies[held] = visuals.add_body(
                _mesh(held, self._seat(held)), texture=visuals.texture(_PALETTE)
            )
        return [self._bodies[held]], place[None]

    def _seat(self, held: str) -> Seat | None:
        return self._worker.seat if held == "seat" else None


@lru_cache(maxsize=64)
def _triangles(held: str, seat: Seat | None) -> TriangleSet:
    mesh = _mesh(held, seat)
    return TriangleSet([(mesh.vertices_m, mesh.indices.reshape(-1, 3))])


def _mesh(held: str, seat: Seat | None) -> Mesh:
    """Return the mesh of an object about its middle."""
    middle = (0.0, 0.0, 0.0)
    if seat is not None and seat.kind == "stool":
        depth, width, height = seat.size_m
        top, leg = _BOARD_SHARE * height, _LEG_SHARE * width
        parts = [(box((0.0, 0.0, 0.5 * (height - top)), (depth, width, top)), _TAPE_UV)]
        parts += [
            (
                box(
                    (0.5 * x * (depth - leg), 0.5 * y * (width - leg), -0.5 * top),
                    (leg, leg, height - top),
                ),
                _CARDBOARD_UV,
            )
            for x in (-1.0, 1.0)
            for y in (-1.0, 1.0)
        ]
    elif seat is not None:
        depth, width, height = seat.size_m
        board = (depth + 2.0 * _BOARD_M, width + 2.0 * _BOARD_M, _BOARD_SHARE * height)
        rim = 0.5 * (1.0 - _BOARD_SHARE) * height
        parts = [(box(middle, seat.size_m), _CARDBOARD_UV)]
        parts += [(box((0.0, 0.0, z), board), _TAPE_UV) for z in (-rim, rim)]
    elif held == "box":
        length, _, height = BOX_SIZE_M
        tape = (length + 0.004, _TAPE_WIDTH_M, height + 0.004)
        parts = [(box(middle, BOX_SIZE_M), _CARDBOARD_UV), (box(middle, tape), _TAPE_UV)]
    else:
        thick, width, height = PHONE_SIZE_M
        screen = box((-0.5 * thick, 0.0, 0.0), (0.002, 0.9 * width, 0.92 * height))
        parts = [(box(middle, PHONE_SIZE_M), _PHONE_UV), (screen, _SCREEN_UV)]
    return _coloured(parts)


def _coloured(parts: list[tuple[Mesh, tuple[float, float]]]) -> Mesh:
    """Return one mesh of all parts, each with one texel of the palette."""
    return merge(
        Mesh(mesh.vertices_m, mesh.normals, mesh.indices, np.tile(uv, (len(mesh.vertices_m), 1)))
        for mesh, uv in parts
    )


def fitting_seat(bones: Skeleton, kind: SeatKind) -> Seat:
    """Return the seat that fits a body.

    Raises:
        SimError: for another kind.
    """
    if kind not in get_args(SeatKind):
        valid = ", ".join(map(repr, get_args(SeatKind)))
        raise SimError(f"seat must be one of {valid}, got {kind!r}")
    size = bones.stature_m / _MEAN_STATURE_M
    height = seated_pose(bones).hip_height_m - _HIPS_ABOVE_SEAT_M * size
    return Seat(kind, (_SEAT_DEPTH_M * size, _SEAT_WIDTH_M * size, height))


def seat_pose(seat: Seat, x_m: float, y_m: float, heading_rad: float) -> FloatArray:
    """Return (4, 4) the pose in odom of a seat's middle under a body at this place."""
    depth, _, height = seat.size_m
    ahead = _SEAT_AHEAD_M / _SEAT_DEPTH_M * depth
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    T_odom_seat = np.eye(4)
    T_odom_seat[:2, :2] = [[cos, -sin], [sin, cos]]
    T_odom_seat[:3, 3] = x_m + cos * ahead, y_m + sin * ahead, 0.5 * height
    return T_odom_seat
