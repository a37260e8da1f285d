"""All surfaces of a hall, cut by the plane of a scan."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Final, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall import WarehouseLayout
from ..sightlines import Occluder, PlacedSurface, TriangleSet, cut_surfaces, scenery_surface

#: Number of the scenery in :meth:`ScanScene.cut`; actors count from 0.
SCENERY: Final = -1

_HOME: Final = np.eye(4)[None]
# Middle level of detail: its outline of a shin is within 2 mm of the finest level's.
_DETAIL: Final = 1
# Reflectance of everything that does not say its own.
_BRIGHT: Final = 1.0
# A plane that is tilted by less than this is level, at a height of whole tenths of a millimetre: a
# robot on its wheels pitches by 0.00002 rad. Level planes are the same from scan to scan, so their
# cuts are kept. 20 m away the difference in height is 1 mm.
_LEVEL_RAD: Final = 5e-5
_HEIGHT_DIGITS: Final = 4
# Segments whose lines differ by less than this, in radians and metres, are on one line, and so are
# those with a smaller gap between them.
_SAME: Final = 1e-9


@runtime_checkable
class Clothed(Protocol):
    """An actor that reflects a scanner's light poorly if it is dark."""

    @property
    def leg_reflectance(self) -> float:
        """Mean luminance of the clothes below the knee, in [0, 1]."""
        ...


class Plane(NamedTuple):
    """A plane n · p = offset in odom, n a unit vector."""

    normal: tuple[float, float, float]
    offset_m: float

    @classmethod
    def through(cls, point_m: FloatArray, normal: FloatArray) -> Plane:
        """Return the plane through a point; one that is nearly level is level."""
        x, y, z = normal.tolist()
        if math.hypot(x, y) < _LEVEL_RAD:
            side = math.copysign(1.0, z)
            return cls((0.0, 0.0, side), side * round(float(point_m[2]), _HEIGHT_DIGITS))
        return cls((x, y, z), float(normal @ point_m))


class SceneCut(NamedTuple):
    """The segments in which a plane cuts a scene; those of a scanner's own robot are the last.

    Attributes:
        segments_odom_m: (S, 2, 3).
        numbers: (S,) the actor of each, :data:`SCENERY` for the hall.
        others: number of segments that are not of the robot that carries the scanners.
    """

    segments_odom_m: FloatArray
    numbers: NDArray[np.int64]
    others: int

    def seen_from(self, T_odom_scanner: FloatArray) -> FloatArray:
        """Return the segments (S, 2, 2) in the frame of a scanner in the plane."""
        points = self.segments_odom_m.reshape(-1, 3) - T_odom_scanner[:3, 3]
        return np.asarray((points @ T_odom_scanner[:3, :2]).reshape(-1, 2, 2))


class ScanScene:
    """The surfaces that scanners see: the hall's, and those of everything that moves in it.

    They are the same triangles as those of :class:`~sim_tests.world.sightlines.SightLines`.

    Args:
        layout: the hall; None for no scenery.
        variant: number of the scenery's variant.
        actors: everything that moves; an actor that is no :class:`Occluder` is not seen.

    Attributes:
        reflectance: (actors + 1,) of the light, in [0, 1]; the last is the scenery's.
    """

    def __init__(
        self, layout: WarehouseLayout | None, variant: int = 0, actors: Iterable[object] = ()
    ) -> None:
        self._layout, self._variant = layout, variant
        self._occluders = [actor for actor in actors if isinstance(actor, Occluder)]
        self.reflectance: FloatArray = np.array(
            [
                actor.leg_reflectance if isinstance(actor, Clothed) else _BRIGHT
                for actor in self._occluders
            ]
            + [_BRIGHT]
        )
        # Which actors are the robot that carries the scanners.
        self._carriers = [getattr(actor, "kind", "") == "robot" for actor in self._occluders]
        # The last cut of the hall, and of each actor that bends: bodies that stand still are not
        # cut again.
        self._scenery: tuple[Plane, FloatArray] | None = None
        self._cuts: dict[int, tuple[PlacedSurface, Plane, FloatArray]] = {}

    @property
    def occluders(self) -> tuple[Occluder, ...]:
        """The actors that are seen, in the order of their numbers."""
        return tuple(self._occluders)

    def cut(self, plane: Plane, origin_odom_m: FloatArray, range_max_m: float) -> SceneCut:
        """Return what the plane of a scan cuts.

        Args:
            plane: in odom.
            origin_odom_m: (3,) a place in the plane, that of the scanner.
            range_max_m: actors farther from it are left out.
        """
        parts = [np.empty((0, 2, 3))]
        numbers = [SCENERY]
        if self._layout is not None:
            if self._scenery is None or self._scenery[0] != plane:
                self._scenery = plane, _scenery_cut(self._layout, self._variant, plane)
            parts[0] = self._scenery[1]
        cuts = self._actors_cut(plane, origin_odom_m, range_max_m)
        own = [cut for cut in cuts if self._carriers[cut[0]]]
        for number, segments in [cut for cut in cuts if not self._carriers[cut[0]]] + own:
            parts.append(segments)
            numbers.append(number)
        counts = [len(segments) for segments in parts]
        others = sum(counts) - sum(len(segments) for _, segments in own)
        return SceneCut(np.concatenate(parts), np.repeat(numbers, counts), others)

    def _actors_cut(
        self, plane: Plane, origin: FloatArray, range_max_m: float
    ) -> list[tuple[int, FloatArray]]:
        """Return the number and the segments (S, 2, 3) in odom of each actor that is cut."""
        if not self._occluders:
            return []
        boxes = np.array([occluder.reach_odom_m() for occluder in self._occluders])
        found: list[tuple[int, FloatArray]] = []
        bending: list[tuple[int, PlacedSurface]] = []
        for number in _meet(boxes, origin, plane, range_max_m).nonzero()[0].tolist():
            surface = self._occluders[number].surface(_DETAIL)
            if surface is None:
                continue
            last = self._cuts.get(number)
            if _is_rigid(surface):
                found.append((number, _cut_of_rigid(surface, plane, origin)))
            elif last is not None and last[0] is surface and last[1] == plane:
                found.append((number, last[2]))
            else:
                bending.append((number, surface))
        if not bending:
            return found
        segments, owners = cut_surfaces(
            [surface for _, surface in bending], np.array(plane.normal), plane.offset_m
        )
        for row, (number, surface) in enumerate(bending):
            own = segments[owners == row]
            self._cuts[number] = surface, plane, own
            found.append((number, own))
        return found


def _meet(
    boxes_odom_m: FloatArray, origin: FloatArray, plane: Plane, reach_m: float
) -> NDArray[np.bool_]:
    """Return (N,) whether a plane meets boxes (N, 2, 3) within reach of the origin."""
    low, high = boxes_odom_m[:, 0], boxes_odom_m[:, 1]
    beyond = np.maximum(np.maximum(low - origin, origin - high), 0.0)
    normal = np.array(plane.normal)
    away = np.abs((low + high) @ normal - 2.0 * plane.offset_m)
    near = (beyond * beyond).sum(axis=1) <= reach_m * reach_m
    return np.asarray(near & (away <= (high - low) @ np.abs(normal)))


def _is_rigid(surface: PlacedSurface) -> bool:
    """Return whether all pieces of a surface have one pose."""
    poses = surface.T_odom_piece
    return len(poses) == 1 or poses.strides[0] == 0


def _cut_of_rigid(surface: PlacedSurface, plane: Plane, origin: FloatArray) -> FloatArray:
    """Return the segments (S, 2, 3) in odom; the cut is kept in the surface's own frame."""
    rotation, place = surface.T_odom_piece[0, :3, :3], surface.T_odom_piece[0, :3, 3]
    normal = np.array(plane.normal)
    # The point of the plane above or below the scanner.
    origin = origin + (plane.offset_m - float(normal @ origin)) * normal
    own = Plane.through((origin - place) @ rotation / surface.scale, normal @ rotation)
    segments = _own_cut(surface.triangles, own)
    points = surface.scale * segments.reshape(-1, 3) @ rotation.T + place
    return np.asarray(points.reshape(-1, 2, 3))


@lru_cache(maxsize=256)
def _own_cut(triangles: TriangleSet, plane: Plane) -> FloatArray:
    places = np.broadcast_to(_HOME, (triangles.pieces, 4, 4))
    segments, _ = cut_surfaces(
        [PlacedSurface(triangles, places)], np.array(plane.normal), plane.offset_m
    )
    return segments


@lru_cache(maxsize=32)  # a robot that stands level scans the same plane again and again
def _scenery_cut(layout: WarehouseLayout, variant: int, plane: Plane) -> FloatArray:
    surface = scenery_surface(layout, variant)
    segments, _ = cut_surfaces([surface], np.array(plane.normal), plane.offset_m)
    return _merged(segments) if plane.normal[:2] == (0.0, 0.0) else segments


def _merged(segments_m: FloatArray) -> FloatArray:
    """Return segments that cover the same points as those given, but do not overlap on a line.

    A rack's side is many triangles, and so as many segments on one line.

    Args:
        segments_m: (S, 2, 3) in one plane of constant z.

    Returns:
        (R, 2, 3), R ≤ S; segments of no length are left out.
    """
    along = segments_m[:, 1, :2] - segments_m[:, 0, :2]
    length = np.sqrt((along * along).sum(axis=1))
    kept = np.flatnonzero(length > _SAME)
    if not kept.size:
        return np.empty((0, 2, 3))
    points = segments_m[kept, :, :2]
    unit = along[kept] / length[kept, None]
    # Both directions of a line are one.
    back = (unit[:, 0] < -_SAME) | ((np.abs(unit[:, 0]) <= _SAME) & (unit[:, 1] < 0.0))
    unit[back] *= -1.0
    normal = np.column_stack((-unit[:, 1], unit[:, 0]))
    offset = (normal * points[:, 0]).sum(axis=1)
    ends = np.sort((points * unit[:, None]).sum(axis=2), axis=1)
    direction = np.round(np.arctan2(unit[:, 1], unit[:, 0]) / _SAME)
    line = np.round(offset / _SAME)
    order = np.lexsort((ends[:, 0], line, direction))
    direction, line, ends = direction[order], line[order], ends[order]
    same = (np.diff(direction) == 0.0) & (np.diff(line) == 0.0)
    rows: list[int] = []
    reached: list[float] = []
    for row, (low, high) in enumerate(ends.tolist()):
        if row and same[row - 1] and low <= reached[-1] + _SAME:
            reached[-1] = max(reached[-1], high)
        else:
            rows.append(row)
            reached.append(high)
    first = order[rows]
    out = np.empty((len(rows), 2, 3))
    foot = normal[first] * offset[first, None]
    out[:, 0, :2] = foot + ends[rows, :1] * unit[first]
    out[:, 1, :2] = foot + np.array(reached)[:, None] * unit[first]
    out[..., 2] = segments_m[0, 0, 2]
    return out
