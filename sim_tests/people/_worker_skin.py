"""What the camera sees of a worker: skin, hair and clothes, in the picture world."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from .._bullet import pybullet
from ..hall._meshes import Mesh
from ._body_pose import link_transform
from ._skin_pieces import SkinPiece, skin_pieces
from ._worker_asset import LEVELS, load_worker

if TYPE_CHECKING:
    from ..pictures._visuals import Visuals
    from ._worker import Worker

# Bands between the two sides of a joint, a level of detail; far away nobody sees a knee bend.
_BANDS: Final = (3, 2, 1)
# A level serves down to so many samples a metre of the picture; the coarsest all the rest.
_COARSEST_SAMPLES_PER_M: Final = (120.0, 60.0)
# How far skin, clothes, hair and hats reach beyond the keypoints.
_REACH_M: Final = 0.30


@lru_cache(maxsize=64)
def _pieces(look: str, level: int) -> tuple[SkinPiece, ...]:
    return skin_pieces(load_worker(look).levels[level], _BANDS[level])


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """One level of detail in the picture world: a body a piece."""

    bodies: tuple[int, ...]
    joints: NDArray[np.int64]
    shares: FloatArray


class WorkerSkin:
    """The actor of one :class:`Worker`; see :class:`Actor`.

    Args:
        worker: whose posture is shown.
        textures: (H, W, 3) uint8 a level of detail to wear instead of the shipped ones, finest
            first.

    Attributes:
        worker: as given.
        kind: ``"person"``.
    """

    kind = "person"

    def __init__(self, worker: Worker, textures: Sequence[NDArray[np.uint8]] | None = None) -> None:
        self.worker = worker
        shipped = tuple(level.texture_rgb for level in worker.asset.levels)
        self._textures = shipped if textures is None else tuple(textures)
        self._visuals: Visuals | None = None
        self._levels: dict[int, _Level] = {}
        self._shown: int | None = None

    def bounds_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box about all of the worker."""
        points = self.worker.keypoints_odom_m
        reach = _REACH_M * max(self.worker.pose.scale, 1.0)
        return np.array([points.min(axis=0) - reach, points.max(axis=0) + reach])

    def build(self, visuals: Visuals) -> None:
        """Note where to draw; each level of detail is made when it is first needed."""
        self._visuals = visuals

    def bodies(self) -> AbstractSet[int]:
        """Ids of all pieces made so far."""
        return {body for level in self._levels.values() for body in level.bodies}

    def show(self, pixels_per_m: float | None) -> None:
        """Take the worker's posture at the level of detail that so many samples a metre need."""
        if self._visuals is None:
            return
        level = None if pixels_per_m is None else _level_for(pixels_per_m)
        if level is not None and level not in self._levels:
            self._levels[level] = self._make(self._visuals, level)
        elif level != self._shown and level is not None:
            for body in self._levels[level].bodies:
                self._visuals.reveal(body)
        if self._shown is not None and level != self._shown:
            for body in self._levels[self._shown].bodies:
                self._visuals.hide(body)
        self._shown = level
        if level is not None:
            self._pose(self._visuals.client, self._levels[level])

    def _make(self, visuals: Visuals, level: int) -> _Level:
        asset, scale = self.worker.asset, self.worker.pose.scale
        pieces = _pieces(asset.name, level)
        texture = visuals.texture(self._textures[level])
        bodies = tuple(
            visuals.add_body(visuals.shape(_scaled(piece.mesh, scale), texture=texture))
            for piece in pieces
        )
        return _Level(
            bodies,
            np.array([piece.joint for piece in pieces]),
            np.array([piece.share for piece in pieces]),
        )

    def _pose(self, client: int, level: _Level) -> None:
        worker = self.worker
        places = link_transform(worker.asset.joints_m, worker.pose, level.joints, level.shares)
        turns = Rotation.from_matrix(places[:, :3, :3]).as_quat()
        for body, position, turn in zip(
            level.bodies, places[:, :3, 3].tolist(), turns.tolist(), strict=True
        ):
            pybullet.resetBasePositionAndOrientation(body, position, turn, physicsClientId=client)


def _level_for(samples_per_m: float) -> int:
    for level, least in enumerate(_COARSEST_SAMPLES_PER_M):
        if samples_per_m >= least:
            return level
    return LEVELS - 1


def _scaled(mesh: Mesh, scale: float) -> Mesh:
    return Mesh(mesh.vertices_m * scale, mesh.normals, mesh.indices, mesh.uv)
