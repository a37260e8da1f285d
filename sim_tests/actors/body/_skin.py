"""Visual actors of a worker: the skin, cut into rigid pieces, and what they hold or sit on.

The skin includes hair and clothes. A box, a phone or a seat is an actor of its own.

The simulator draws only rigid bodies. At a joint whose rotation is R, skin of weight w should turn
by R to the power w. The weights between 0 and 1 are divided into ``bands`` equal steps, and each
step is a piece of its own. A triangle belongs to every piece whose weight differs from its own by
little more than one step. Two or three pieces therefore draw it, and no gap opens where the body
bends. Where a piece overlaps skin that its neighbour fits better, it lies below the surface;
otherwise its rim would stick out of a bent knee.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ...world.errors import SimError
from ...world.hall import Mesh, box, merge
from ...world.render import RenderView, Visuals, box_corners, in_view, to_camera
from ...world.sightlines import PlacedSurface, TriangleSet
from ._asset import DETAIL_LEVELS, JOINTS, PARENTS, SkinMesh, WorkerAsset, load_worker
from ._pose import BodyPose, RigidPieces
from ._postures import BOX_SIZE_M, PHONE_SIZE_M, seated_pose
from ._quaternions import Vector
from ._skeleton import Skeleton

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
_HELD_REACH_M: Final = 0.5 * float(np.linalg.norm(BOX_SIZE_M))


@dataclass(frozen=True, slots=True)
class Seat:
    """A seat, which stands on the floor."""

    kind: SeatKind
    size_m: Vector


class Holder(PosedBody, Protocol):
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


class HeldObject:
    """The visual actor of the object that a :class:`Worker` holds or sits on.

    It is separate from the person's actor, so that a box hides the chest behind it.
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
        reach = _HELD_REACH_M
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
        return PlacedSurface(_object_triangles(held, self._seat(held)), place[None])

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[list[int], FloatArray]:
        """Return the object, made when it is first held; all levels of detail are the same."""
        held, place = self._worker.held, self._worker.T_odom_held
        if held is None or place is None:
            return [], np.empty((0, 4, 4))
        if held not in self._bodies:
            self._bodies[held] = visuals.add_body(
                _object_mesh(held, self._seat(held)), texture=visuals.texture(_PALETTE)
            )
        return [self._bodies[held]], place[None]

    def _seat(self, held: str) -> Seat | None:
        return self._worker.seat if held == "seat" else None


@lru_cache(maxsize=64)
def _object_triangles(held: str, seat: Seat | None) -> TriangleSet:
    mesh = _object_mesh(held, seat)
    return TriangleSet([(mesh.vertices_m, mesh.indices.reshape(-1, 3))])


def _object_mesh(held: str, seat: Seat | None) -> Mesh:
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
    """Return the seat that fits a body."""
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
