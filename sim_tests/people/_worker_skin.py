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
from ..pictures._culling import box_corners, in_view, to_camera
from ..sightlines._sight_lines import PlacedSurface
from ..sightlines._triangles import TriangleSet
from ._body_pose import BodyPose, link_transform
from ._skin_pieces import SkinPiece, skin_pieces
from ._worker_asset import LEVELS, load_worker

if TYPE_CHECKING:
    from ..pictures._view import View
    from ..pictures._visuals import Visuals
    from ._worker import Worker

# Bands between the two sides of a joint, a level of detail; far away nobody sees a knee bend.
_BANDS: Final = (5, 2, 1)
# A level serves down to so many samples a metre of the picture; the coarsest all the rest.
_COARSEST_SAMPLES_PER_M: Final = (120.0, 60.0)
# How far skin, clothes, hair and hats reach beyond the keypoints.
_REACH_M: Final = 0.30


@lru_cache(maxsize=64)
def _pieces(look: str, level: int) -> tuple[SkinPiece, ...]:
    return skin_pieces(load_worker(look).levels[level], _BANDS[level])


@lru_cache(maxsize=64)
def _surface(look: str, level: int) -> tuple[TriangleSet, NDArray[np.int64], FloatArray]:
    """Triangles of all pieces, and the joint and share of each piece."""
    pieces = _pieces(look, level)
    return (
        TriangleSet([(p.mesh.vertices_m, p.mesh.indices.reshape(-1, 3)) for p in pieces]),
        np.array([piece.joint for piece in pieces]),
        np.array([piece.share for piece in pieces]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """One level of detail in the picture world: a body a piece."""

    bodies: tuple[int, ...]
    joints: NDArray[np.int64]
    shares: FloatArray
    boxes_m: FloatArray  # (P, 8, 3) corners about each piece at rest, scaled


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
        self._shown: set[int] = set()
        # The last pose asked for, and its surface by level of detail.
        self._surface_pose: BodyPose | None = None
        self._surfaces: dict[int, PlacedSurface] = {}

    def reach_odom_m(self) -> FloatArray:
        """As :meth:`Worker.reach_odom_m`."""
        return self.worker.reach_odom_m()

    def surface(self, detail: int) -> PlacedSurface:
        """The skin as it is bent now, at a level of detail."""
        worker, pose = self.worker, self.worker.pose
        if self._surface_pose is not pose:
            self._surface_pose = pose
            self._surfaces.clear()
        if detail not in self._surfaces:
            asset = worker.asset
            triangles, joints, shares = _surface(asset.name, detail)
            places = link_transform(asset.joints_m, pose, joints, shares, worker.links_odom)
            self._surfaces[detail] = PlacedSurface(triangles, places, pose.scale)
        return self._surfaces[detail]

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

    def show(self, pixels_per_m: float | None, view: View | None = None) -> None:
        """Take the worker's posture at the level of detail that so many samples a metre need."""
        visuals = self._visuals
        if visuals is None:
            return
        shown: set[int] = set()
        if pixels_per_m is not None:
            number = _level_for(pixels_per_m)
            if number not in self._levels:
                self._levels[number] = self._make(visuals, number)
                self._shown |= set(self._levels[number].bodies)
            level = self._levels[number]
            places = self._places(level)
            rows = _rows_in_view(level, places, view)
            shown = {level.bodies[row] for row in rows}
        for body in self._shown - shown:
            visuals.hide(body)
        for body in shown - self._shown:
            visuals.reveal(body)
        self._shown = shown
        if shown:
            _pose(visuals.client, level, places, rows)

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
            box_corners(
                scale
                * np.array(
                    [
                        (piece.mesh.vertices_m.min(axis=0), piece.mesh.vertices_m.max(axis=0))
                        for piece in pieces
                    ]
                )
            ),
        )

    def _places(self, level: _Level) -> FloatArray:
        """(P, 4, 4) from each piece at rest to odom."""
        joints_m, pose = self.worker.asset.joints_m, self.worker.pose
        return link_transform(joints_m, pose, level.joints, level.shares)


def _rows_in_view(level: _Level, places: FloatArray, view: View | None) -> list[int]:
    """Pieces that the view may show."""
    if view is None:
        return list(range(len(level.bodies)))
    corners = np.einsum("pij,pkj->pki", places[:, :3, :3], level.boxes_m) + places[:, None, :3, 3]
    rows: list[int] = np.flatnonzero(in_view(view, to_camera(view, corners))).tolist()
    return rows


def _pose(client: int, level: _Level, places: FloatArray, rows: list[int]) -> None:
    turns = Rotation.from_matrix(places[rows, :3, :3]).as_quat().tolist()
    for row, position, turn in zip(rows, places[rows, :3, 3].tolist(), turns, strict=True):
        pybullet.resetBasePositionAndOrientation(
            level.bodies[row], position, turn, physicsClientId=client
        )


def _level_for(samples_per_m: float) -> int:
    for level, least in enumerate(_COARSEST_SAMPLES_PER_M):
        if samples_per_m >= least:
            return level
    return LEVELS - 1


def _scaled(mesh: Mesh, scale: float) -> Mesh:
    return Mesh(mesh.vertices_m * scale, mesh.normals, mesh.indices, mesh.uv)
