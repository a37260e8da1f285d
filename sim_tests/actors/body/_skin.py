"""Cuts a worker's skin into rigid pieces, since the simulator draws nothing that bends.

At a joint whose rotation is R, skin of weight w ought to turn by R to the power w. The weight is
quantised into ``bands`` equal steps between 0 and 1, and every step is a piece of its own. Each
triangle joins every piece whose weight is not much more than one step away from its own, so that
the nearest two or three draw it and no gap opens where the body bends. Where a piece overlaps the
part that its neighbour fits better, it dips under the skin: its rim would stick out of a bent knee.


What the camera sees of a worker: skin, hair and clothes, in the picture world.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ...world.bullet import pybullet
from ...world.hall import Mesh
from ...world.render import RenderView, Visuals, box_corners, in_view, to_camera
from ...world.sightlines import PlacedSurface, TriangleSet
from ._asset import JOINTS, LEVELS, PARENTS, SkinMesh, WorkerAsset, load_worker
from ._pose import BodyPose, link_transform

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


class PosedBody(Protocol):
    """A body whose posture a skin shows, as :class:`Worker` is."""

    @property
    def asset(self) -> WorkerAsset:
        """Meshes, joints and keypoints."""
        ...

    @property
    def pose(self) -> BodyPose:
        """The posture."""
        ...

    @property
    def links_odom(self) -> FloatArray:
        """(J, 4, 4) where the links are."""
        ...

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(K, 3) keypoints."""
        ...

    def reach_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box about the body."""
        ...


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

    def __init__(
        self, worker: PosedBody, textures: Sequence[NDArray[np.uint8]] | None = None
    ) -> None:
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

    def show(self, pixels_per_m: float | None, view: RenderView | None = None) -> None:
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


def _rows_in_view(level: _Level, places: FloatArray, view: RenderView | None) -> list[int]:
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
