"""Visual actor of a worker: skin, hair and clothes, cut into rigid pieces.

The simulator draws only rigid bodies. At a joint whose rotation is R, skin of weight w should turn
by R to the power w. The weights between 0 and 1 are divided into ``bands`` equal steps, and each
step is a piece of its own. A triangle belongs to every piece whose weight differs from its own by
little more than one step. Two or three pieces therefore draw it, and no gap opens where the body
bends. Where a piece overlaps skin that its neighbour fits better, it lies below the surface;
otherwise its rim would stick out of a bent knee.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ...world.hall import Mesh
from ...world.render import RenderView, Visuals, box_corners, in_view, to_camera
from ...world.sightlines import PlacedSurface, TriangleSet
from ._asset import DETAIL_LEVELS, JOINTS, PARENTS, SkinMesh, WorkerAsset, load_worker
from ._pose import BodyPose, RigidPieces

#: Row of the pelvis among the joints.
PELVIS: Final = -1

# Largest difference between the weights of a triangle and of its piece, in steps.
_OVERLAP: Final = 1.6
# Weights this near to 0 or 1 do not bend.
_RIGID: Final = 1.0e-3
# Depth of a piece's rim per step of difference in weight, and the largest multiple of it.
_SINK_M: Final = 0.012
_MAX_SINK: Final = 3.0
# Bands between the two sides of a joint, by level of detail.
_BANDS: Final = (5, 2, 1)
# Fewest samples per metre of image for each level but the coarsest.
_MIN_SAMPLES_PER_M: Final = (120.0, 60.0)
# Heights on a body at rest at which scanners see it, and weights of red, green and blue (BT.709).
_LEG_HEIGHTS_M: Final = (0.12, 0.4)
_LUMINANCE: Final = np.array([0.2126, 0.7152, 0.0722])
# Skin, clothes, hair and hats reach at most this far beyond the keypoints.
_REACH_M: Final = 0.30


@dataclass(frozen=True, eq=False)
class SkinPiece:
    """A rigid part of the body's surface at rest.

    Attributes:
        joint: row in :data:`JOINTS`, −1 for the pelvis.
        share: share of the joint's rotation that the piece follows, in (0, 1].
        mesh: surface at rest in the body's frame.
    """

    joint: int
    share: float
    mesh: Mesh


def skin_pieces(skin: SkinMesh, bands: int) -> tuple[SkinPiece, ...]:
    """Cut ``skin`` into rigid pieces with ``bands`` ≥ 0 between the two sides of every joint."""
    step = 1.0 / (bands + 1)
    weights = skin.weights[skin.triangles].mean(axis=1)
    pieces = []
    for joint in (PELVIS, *range(len(JOINTS))):
        # Beyond a child joint's first step its own pieces take over.
        above_children = np.ones(len(skin.triangles), dtype=bool)
        for child, parent in enumerate(PARENTS):
            if parent == joint:
                above_children &= weights[:, child] < _OVERLAP * step
        for level in range(1, bands + 2) if joint != PELVIS else (bands + 1,):
            share = level * step
            chosen = above_children.copy() if level == bands + 1 else np.ones_like(above_children)
            if joint != PELVIS:
                chosen &= np.abs(weights[:, joint] - share) < _OVERLAP * step
                # Skin that does not bend is drawn once.
                chosen &= weights[:, joint] > _RIGID
                if level <= bands:
                    chosen &= weights[:, joint] < 1.0 - _RIGID
            if chosen.any():
                off = _weight_difference(skin, joint, share, level == bands + 1)
                sink_m = _SINK_M * np.clip(off / step - 0.5, 0.0, _MAX_SINK)
                pieces.append(
                    SkinPiece(joint, share, _submesh(skin, skin.triangles[chosen], sink_m))
                )
    return tuple(pieces)


def _weight_difference(skin: SkinMesh, joint: int, share: float, whole: bool) -> FloatArray:
    """Return (V,) the difference between each vertex's weight and that of a piece."""
    off = [np.zeros(len(skin.vertices_m))]
    if joint != PELVIS:
        off.append(np.abs(skin.weights[:, joint] - share))
    if whole:
        off += [skin.weights[:, c] for c, parent in enumerate(PARENTS) if parent == joint]
    return np.asarray(np.max(off, axis=0))


def _submesh(skin: SkinMesh, triangles: NDArray[np.int64], sink_m: FloatArray) -> Mesh:
    """Return these triangles with their vertices moved inwards by ``sink_m``."""
    used, rows = np.unique(triangles.ravel(), return_inverse=True)
    vertices = skin.vertices_m[used] - sink_m[used, None] * skin.normals[used]
    return Mesh(vertices, skin.normals[used], rows.astype(np.int64), skin.uv[used])


@lru_cache(maxsize=64)
def _pieces(look: str, level: int) -> tuple[SkinPiece, ...]:
    return skin_pieces(load_worker(look).levels[level], _BANDS[level])


@lru_cache(maxsize=64)
def _leg_reflectance(look: str) -> float:
    level = load_worker(look).levels[DETAIL_LEVELS - 1]
    low, high = _LEG_HEIGHTS_M
    rows = (level.vertices_m[:, 2] > low) & (level.vertices_m[:, 2] < high)
    height, width = level.texture_rgb.shape[:2]
    column = np.clip(level.uv[rows, 0] * width, 0, width - 1).astype(int)
    # The first row of a texture lies at v = 1.
    row = np.clip((1.0 - level.uv[rows, 1]) * height, 0, height - 1).astype(int)
    return float((level.texture_rgb[row, column] / 255.0 @ _LUMINANCE).mean())


@lru_cache(maxsize=64)
def _rigid(look: str, level: int) -> RigidPieces:
    """Return the motion of the pieces."""
    pieces = _pieces(look, level)
    joints, shares = np.array([p.joint for p in pieces]), np.array([p.share for p in pieces])
    return RigidPieces(load_worker(look).joints_m, joints, shares)


@lru_cache(maxsize=64)
def _triangles(look: str, level: int) -> TriangleSet:
    """Return the triangles of the pieces."""
    pieces = _pieces(look, level)
    return TriangleSet([(p.mesh.vertices_m, p.mesh.indices.reshape(-1, 3)) for p in pieces])


@dataclass(frozen=True, slots=True, eq=False)
class _Level:
    """One level of detail in the render world, with one body per piece."""

    bodies: tuple[int, ...]
    rigid: RigidPieces
    boxes_m: FloatArray  # (P, 8, 3) corners of a box around each scaled piece at rest


class PosedBody(Protocol):
    """A body whose pose a skin shows; :class:`Worker` is one."""

    @property
    def asset(self) -> WorkerAsset:
        """The shipped worker: meshes, joints and keypoints."""
        ...

    @property
    def pose(self) -> BodyPose:
        """The pose."""
        ...

    @property
    def links_odom(self) -> FloatArray:
        """(J, 4, 4) link transforms to odom."""
        ...

    @property
    def keypoints_odom_m(self) -> FloatArray:
        """(K, 3) keypoints."""
        ...

    def reach_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the body."""
        ...


class WorkerSkin:
    """The visual actor of one :class:`Worker`.

    Args:
        worker: the body to show.
        textures: (H, W, 3) uint8 per level of detail, finest first; None takes the shipped ones.

    Attributes:
        worker: as given.
        kind: ``"person"``.
    """

    kind = "person"

    def __init__(
        self, worker: PosedBody, textures: Sequence[NDArray[np.uint8]] | None = None
    ) -> None:
        self.worker = worker
        self._textures = None if textures is None else tuple(textures)
        self._levels: dict[int, _Level] = {}
        # Surfaces of the last requested pose by level of detail.
        self._surface_pose: BodyPose | None = None
        self._surfaces: dict[int, PlacedSurface] = {}

    def reach_odom_m(self) -> FloatArray:
        """Return the reach of the body; see :meth:`Worker.reach_odom_m`."""
        return self.worker.reach_odom_m()

    def surface(self, detail: int) -> PlacedSurface:
        """Return the skin in its present pose at a level of detail."""
        worker, pose = self.worker, self.worker.pose
        if self._surface_pose is not pose:
            self._surface_pose = pose
            self._surfaces.clear()
        if detail not in self._surfaces:
            look = worker.asset.name
            places = _rigid(look, detail).odom(pose, worker.links_odom)
            self._surfaces[detail] = PlacedSurface(_triangles(look, detail), places, pose.scale)
        return self._surfaces[detail]

    @property
    def leg_reflectance(self) -> float:
        """The mean luminance in [0, 1] of the shipped clothes at the height of a scanner."""
        return _leg_reflectance(self.worker.asset.name)

    def bounds_odom_m(self) -> FloatArray:
        """Return (2, 3) the low and high corner of a box that holds the worker now."""
        points = self.worker.keypoints_odom_m
        reach = _REACH_M * max(self.worker.pose.scale, 1.0)
        return np.array([points.min(axis=0) - reach, points.max(axis=0) + reach])

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[list[int], FloatArray]:
        """Return the pieces that the view may show, at this level of detail, and their poses."""
        number = _level_for(samples_per_m)
        if number not in self._levels:
            self._levels[number] = self._make(visuals, number)
        level = self._levels[number]
        places = level.rigid.odom(self.worker.pose, self.worker.links_odom)
        rows = _rows_in_view(level, places, view)
        return [level.bodies[row] for row in rows], places[rows]

    def _make(self, visuals: Visuals, level: int) -> _Level:
        asset, scale = self.worker.asset, self.worker.pose.scale
        pieces = _pieces(asset.name, level)
        shipped, own = self.worker.asset.levels, self._textures
        texture = visuals.texture(shipped[level].texture_rgb if own is None else own[level])
        bodies = tuple(
            visuals.add_body(_scaled(piece.mesh, scale), texture=texture) for piece in pieces
        )
        return _Level(
            bodies,
            _rigid(asset.name, level),
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


def _rows_in_view(level: _Level, places: FloatArray, view: RenderView) -> list[int]:
    """Return the rows of the pieces that the view may show."""
    corners = np.einsum("pij,pkj->pki", places[:, :3, :3], level.boxes_m) + places[:, None, :3, 3]
    rows: list[int] = np.flatnonzero(in_view(view, to_camera(view, corners))).tolist()
    return rows


def _level_for(samples_per_m: float) -> int:
    for level, least in enumerate(_MIN_SAMPLES_PER_M):
        if samples_per_m >= least:
            return level
    return DETAIL_LEVELS - 1


def _scaled(mesh: Mesh, scale: float) -> Mesh:
    return Mesh(mesh.vertices_m * scale, mesh.normals, mesh.indices, mesh.uv)
