"""Cuts a worker's skin into rigid pieces, since the simulator draws nothing that bends.

At a joint whose rotation is R, skin of weight w ought to turn by R to the power w. The weight is
quantised into ``bands`` equal steps between 0 and 1, and every step is a piece of its own. Each
triangle joins every piece whose weight is not much more than one step away from its own, so that
the nearest two or three draw it and no gap opens where the body bends. Where a piece overlaps the
part that its neighbour fits better, it dips under the skin: its rim would stick out of a bent knee.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall._meshes import Mesh
from ._worker_asset import JOINTS, PARENTS, SkinMesh

# How many steps off a triangle's weight may be from that of a piece.
_OVERLAP: Final = 1.6
_RIGID: Final = 1.0e-3
# A rim lies so deep where its weight is a whole step off, and at most so many times as deep.
_SINK_M: Final = 0.012
_MOST_SUNK: Final = 3.0
#: Number of the pelvis among joints.
PELVIS = -1


@dataclass(frozen=True, eq=False)
class SkinPiece:
    """A rigid part of the body's surface at rest.

    Attributes:
        joint: row in :data:`JOINTS`, or −1 for what moves with the pelvis.
        share: how much of that joint's rotation the piece follows, in (0, 1].
        mesh: the surface at rest in the body's frame.
    """

    joint: int
    share: float
    mesh: Mesh


def skin_pieces(skin: SkinMesh, bands: int) -> tuple[SkinPiece, ...]:
    """Cut ``skin`` into rigid pieces, ``bands`` ≥ 0 between the two sides of every joint."""
    step = 1.0 / (bands + 1)
    weights = skin.weights[skin.triangles].mean(axis=1)
    pieces = []
    for joint in (PELVIS, *range(len(JOINTS))):
        # What hangs below takes over one step after it has begun.
        unbent = np.ones(len(skin.triangles), dtype=bool)
        for child, parent in enumerate(PARENTS):
            if parent == joint:
                unbent &= weights[:, child] < _OVERLAP * step
        for level in range(1, bands + 2) if joint != PELVIS else (bands + 1,):
            share = level * step
            chosen = unbent.copy() if level == bands + 1 else np.ones_like(unbent)
            if joint != PELVIS:
                chosen &= np.abs(weights[:, joint] - share) < _OVERLAP * step
                # What does not bend at all is drawn once.
                chosen &= weights[:, joint] > _RIGID
                if level <= bands:
                    chosen &= weights[:, joint] < 1.0 - _RIGID
            if chosen.any():
                beyond = _beyond(skin, joint, share, level == bands + 1)
                sink_m = _SINK_M * np.clip(beyond / step - 0.5, 0.0, _MOST_SUNK)
                pieces.append(SkinPiece(joint, share, _part(skin, skin.triangles[chosen], sink_m)))
    return tuple(pieces)


def _beyond(skin: SkinMesh, joint: int, share: float, whole: bool) -> FloatArray:
    """(V,) how far each vertex's weight is from that of a piece."""
    off = [np.zeros(len(skin.vertices_m))]
    if joint != PELVIS:
        off.append(np.abs(skin.weights[:, joint] - share))
    if whole:
        off += [skin.weights[:, c] for c, parent in enumerate(PARENTS) if parent == joint]
    return np.asarray(np.max(off, axis=0))


def _part(skin: SkinMesh, triangles: NDArray[np.int64], sink_m: FloatArray) -> Mesh:
    """Only the vertices that the triangles use, each moved inwards by so much."""
    used, rows = np.unique(triangles.ravel(), return_inverse=True)
    vertices = skin.vertices_m[used] - sink_m[used, None] * skin.normals[used]
    return Mesh(vertices, skin.normals[used], rows.astype(np.int64), skin.uv[used])
