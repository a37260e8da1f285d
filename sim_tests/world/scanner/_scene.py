"""All surfaces of a hall, cut by the plane of a scan."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall import WarehouseLayout
from ..sightlines import Occluder, PlacedSurface, scenery_triangles

#: Number of the scenery in :meth:`ScanScene.cut`; actors count from 0.
SCENERY: Final = -1

_HOME: Final = np.eye(4)[None]
# Middle level of detail: its outline of a shin is within 2 mm of the finest level's.
_DETAIL: Final = 1
# Reflectance of everything that does not say its own.
_BRIGHT: Final = 1.0


@runtime_checkable
class Clothed(Protocol):
    """An actor that reflects a scanner's light poorly if it is dark."""

    @property
    def leg_reflectance(self) -> float:
        """Mean luminance of the clothes below the knee, in [0, 1]."""
        ...


class ScanScene:
    """The surfaces that scanners see: the hall's, and those of everything that moves in it.

    They are the same triangles as those of :class:`~sim_tests.world.sightlines.SightLines`.

    Args:
        layout: the hall; None for no scenery.
        variant: number of the scenery's variant.
        actors: everything that moves; an actor that is no :class:`Occluder` is not seen.
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

    @property
    def occluders(self) -> tuple[Occluder, ...]:
        """The actors that are seen, in the order of their numbers."""
        return tuple(self._occluders)

    def cut(
        self, T_odom_scanner: FloatArray, range_max_m: float
    ) -> tuple[FloatArray, NDArray[np.int64]]:
        """Return what the scan plane cuts.

        Args:
            T_odom_scanner: (4, 4) pose of the scanner; the plane is its x-y plane.
            range_max_m: actors farther away are left out.

        Returns:
            Segments (S, 2, 2) in the scanner's frame, and the number (S,) of the actor of each,
            :data:`SCENERY` for the hall.
        """
        rotation, origin = T_odom_scanner[:3, :3], T_odom_scanner[:3, 3]
        normal = np.ascontiguousarray(rotation[:, 2])
        offset = float(normal @ origin)
        parts = [np.empty((0, 2, 3))]
        owners = [np.empty(0, dtype=np.int64)]
        if self._layout is not None:
            scenery = _scenery_cut(
                self._layout, self._variant, tuple(normal.round(12).tolist()), round(offset, 9)
            )
            parts.append(scenery)
            owners.append(np.full(len(scenery), SCENERY))
        for number, occluder in enumerate(self._occluders):
            box = occluder.reach_odom_m()
            if not _meets(box, origin, normal, offset, range_max_m):
                continue
            surface = occluder.surface(_DETAIL)
            if surface is None:
                continue
            segments = surface.cut(normal, offset)
            parts.append(segments)
            owners.append(np.full(len(segments), number))
        segments = (np.concatenate(parts) - origin) @ rotation
        return np.ascontiguousarray(segments[..., :2]), np.concatenate(owners)


def _meets(
    box_odom_m: FloatArray, origin: FloatArray, normal: FloatArray, offset: float, reach_m: float
) -> bool:
    """Return whether a plane meets a box within reach of the origin."""
    low, high = box_odom_m
    beyond = np.maximum(np.maximum(low - origin, origin - high), 0.0)
    if float(beyond @ beyond) > reach_m * reach_m:
        return False
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return abs(float(normal @ middle) - offset) <= float(np.abs(normal) @ half)


@lru_cache(maxsize=32)  # a robot that stands level scans the same plane again and again
def _scenery_cut(
    layout: WarehouseLayout, variant: int, normal: tuple[float, float, float], offset_m: float
) -> FloatArray:
    surface = PlacedSurface(scenery_triangles(layout, variant), _HOME)
    return surface.cut(np.array(normal), offset_m)
