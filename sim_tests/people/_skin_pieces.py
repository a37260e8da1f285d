"""Cuts a worker's skin into rigid pieces, since the simulator draws nothing that bends.

At a joint whose rotation is R, skin of weight w ought to turn by R to the power w. The weight is
quantised into ``bands`` equal steps between 0 and 1, and every step is a piece of its own. Each
triangle joins every piece whose weight is less than one step away from that of one of its corners,
so that neighbouring pieces overlap by a step and no gap opens where the body bends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..hall._meshes import Mesh
from ._worker_asset import JOINTS, PARENTS, SkinMesh

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
    children = [[child for child, up in enumerate(PARENTS) if up == joint] for joint in _ALL]
    pieces = []
    for joint, below in zip(_ALL, children, strict=True):
        # What hangs below takes over one step after it has begun.
        unbent = np.ones(len(skin.vertices_m), dtype=bool)
        for child in below:
            unbent &= skin.weights[:, child] < step
        for level in range(1, bands + 2) if joint != PELVIS else (bands + 1,):
            share = level * step
            chosen = unbent.copy() if level == bands + 1 else np.ones_like(unbent)
            if joint != PELVIS:
                chosen &= np.abs(skin.weights[:, joint] - share) < step
            triangles = skin.triangles[chosen[skin.triangles].any(axis=1)]
            if len(triangles):
                pieces.append(SkinPiece(joint, share, _part(skin, triangles)))
    return tuple(pieces)


_ALL = (PELVIS, *range(len(JOINTS)))


def _part(skin: SkinMesh, triangles: NDArray[np.int64]) -> Mesh:
    """Only the vertices that the triangles use."""
    used, rows = np.unique(triangles.ravel(), return_inverse=True)
    return Mesh(skin.vertices_m[used], skin.normals[used], rows.astype(np.int64), skin.uv[used])
