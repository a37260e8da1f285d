"""What the camera sees of the things in a worker's hands: a carton, a telephone."""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from functools import lru_cache
from typing import Final, Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world.bullet import pybullet
from ...world.hall import Mesh, box, merge
from ...world.render import RenderView, Visuals
from ...world.sightlines import PlacedSurface, TriangleSet
from ._postures import BOX_SIZE_M, PHONE_SIZE_M

# Colours, a texel each: carton, tape, telephone, its screen.
_PALETTE: Final = np.array(
    [[[176, 136, 92], [206, 184, 142], [28, 28, 32], [150, 190, 220]]], dtype=np.uint8
).repeat(4, axis=0)
_CARTON_UV, _TAPE_UV, _SLAB_UV, _SCREEN_UV = ((0.125 + 0.25 * k, 0.5) for k in range(4))
_TAPE_M: Final = 0.05
# A box about either thing, however it is turned.
_REACH_M: Final = 0.5 * float(np.linalg.norm(BOX_SIZE_M))


class Holder(Protocol):
    """A body that may hold something, as :class:`Worker` is."""

    @property
    def held(self) -> str | None:
        """What is in the hands; None for empty ones."""
        ...

    @property
    def T_odom_held(self) -> FloatArray | None:  # noqa: N802
        """(4, 4) where it is."""
        ...

    @property
    def chest_odom_m(self) -> FloatArray:
        """(3,) middle of the chest."""
        ...

    def reach_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box about the body."""
        ...


class HeldThing:
    """The actor of whatever a :class:`Worker` holds; see :class:`Actor`.

    It is an actor of its own, so that a carton before somebody's chest hides it instead of being
    part of the person.

    Args:
        worker: whose hands.

    Attributes:
        kind: ``"prop"``.
    """

    kind = "prop"

    def __init__(self, worker: Holder) -> None:
        self._worker = worker
        self._visuals: Visuals | None = None
        self._things: dict[str, int] = {}
        self._shown: str | None = None

    def bounds_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box about the thing; a point with empty hands."""
        place = self._worker.T_odom_held
        if place is None:
            return np.array([self._worker.chest_odom_m] * 2)
        return np.array([place[:3, 3] - _REACH_M, place[:3, 3] + _REACH_M])

    def reach_odom_m(self) -> FloatArray:
        """The worker's reach; a point with empty hands."""
        reach = self._worker.reach_odom_m()
        return reach if self._worker.held is not None else np.array([reach[0], reach[0]])

    def surface(self, detail: int) -> PlacedSurface | None:
        """The thing where it is now; None with empty hands. There is one level of detail."""
        held, place = self._worker.held, self._worker.T_odom_held
        if held is None or place is None:
            return None
        return PlacedSurface(_triangles(held), place[None])

    def build(self, visuals: Visuals) -> None:
        """Note where to draw; each thing is made when it is first held."""
        self._visuals = visuals

    def bodies(self) -> AbstractSet[int]:
        """Ids of all things made so far."""
        return set(self._things.values())

    def show(self, pixels_per_m: float | None, view: RenderView | None = None) -> None:
        """Put the thing into the hands; there is one level of detail."""
        visuals = self._visuals
        if visuals is None:
            return
        held = None if pixels_per_m is None else self._worker.held
        if held is not None and held not in self._things:
            self._things[held] = visuals.add_body(_shape(visuals, held))
        elif held is not None and held != self._shown:
            visuals.reveal(self._things[held])
        if self._shown is not None and held != self._shown:
            visuals.hide(self._things[self._shown])
        self._shown = held
        place = self._worker.T_odom_held
        if held is not None and place is not None:
            pybullet.resetBasePositionAndOrientation(
                self._things[held],
                place[:3, 3].tolist(),
                Rotation.from_matrix(place[:3, :3]).as_quat().tolist(),
                physicsClientId=visuals.client,
            )


def _shape(visuals: Visuals, held: str) -> int:
    """The shape of a thing about its middle."""
    return visuals.shape(_mesh(held), texture=visuals.texture(_PALETTE))


@lru_cache(maxsize=2)
def _triangles(held: str) -> TriangleSet:
    mesh = _mesh(held)
    return TriangleSet([(mesh.vertices_m, mesh.indices.reshape(-1, 3))])


def _mesh(held: str) -> Mesh:
    middle = (0.0, 0.0, 0.0)
    if held == "box":
        length, _, height = BOX_SIZE_M
        tape = (length + 0.004, _TAPE_M, height + 0.004)
        parts = [(box(middle, BOX_SIZE_M), _CARTON_UV), (box(middle, tape), _TAPE_UV)]
    else:
        thick, width, height = PHONE_SIZE_M
        screen = box((-0.5 * thick, 0.0, 0.0), (0.002, 0.9 * width, 0.92 * height))
        parts = [(box(middle, PHONE_SIZE_M), _SLAB_UV), (screen, _SCREEN_UV)]
    return _coloured(parts)


def _coloured(parts: list[tuple[Mesh, tuple[float, float]]]) -> Mesh:
    """One mesh whose parts each take one texel of the palette."""
    return merge(
        Mesh(mesh.vertices_m, mesh.normals, mesh.indices, np.tile(uv, (len(mesh.vertices_m), 1)))
        for mesh, uv in parts
    )
