"""Triangle meshes for rendering (boxes, quads, meshes of files, chunks of scenery), and textures.

Collision shapes are separate and simpler. The textures of halls and of the robot, with the named
rectangles in them, are files beside this module; training/hall of commit 3030439d painted them.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.errors import not_one_of
from perception.arrays import FloatArray
from perception.documents import parse_json

from ..errors import SimError

#: The faces of a box in the order of its vertices: each face has four of them.
BOX_FACES: Final = ("-x", "+x", "-y", "+y", "-z", "+z")

#: Red, green and blue, 0 to 1.
Colour = tuple[float, float, float]
#: A rectangle of a texture: u and v of its lower left corner, then of its upper right one.
Region = tuple[float, float, float, float]
WHOLE: Final[Region] = (0.0, 0.0, 1.0, 1.0)

_BOX_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
# Corners of the six faces, counter-clockwise as seen from outside.
_BOX_FACE_CORNERS = (
    (0, 1, 3, 2),
    (4, 6, 7, 5),
    (0, 4, 5, 1),
    (2, 3, 7, 6),
    (0, 2, 6, 4),
    (1, 5, 7, 3),
)
_UNIT_BOX = _BOX_CORNERS[np.array(_BOX_FACE_CORNERS)].reshape(24, 3)
# The centre of a face of the unit box is its normal.
_BOX_NORMALS = np.repeat(_UNIT_BOX.reshape(6, 4, 3).mean(axis=1), 4, axis=0)
_BOX_INDICES = (np.array((0, 1, 2, 0, 2, 3)) + 4 * np.arange(6)[:, None]).ravel()
# Textures stand upright on the four sides; on top v runs along y, on the bottom against it.
_BOX_UV = np.array(
    [
        *((1, 0), (1, 1), (0, 1), (0, 0)),
        *((0, 0), (1, 0), (1, 1), (0, 1)),
        *((0, 0), (1, 0), (1, 1), (0, 1)),
        *((1, 0), (1, 1), (0, 1), (0, 0)),
        *((0, 1), (0, 0), (1, 0), (1, 1)),
        *((0, 0), (1, 0), (1, 1), (0, 1)),
    ],
    dtype=np.float64,
)
_QUAD_UV = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with one normal per vertex.

    Attributes:
        vertices_m: (N, 3).
        normals: (N, 3) unit vectors pointing outwards.
        indices: (3 T,) rows of vertices, three per triangle, counter-clockwise from outside.
        uv: (N, 2) texture coordinates, (0, 0) at the texture's lower left; None without a texture.
    """

    vertices_m: FloatArray
    normals: FloatArray
    indices: NDArray[np.int64]
    uv: FloatArray | None = None

    def transformed(
        self, rotation: FloatArray | None = None, translation_m: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Mesh:
        """Return a copy that is rotated (3, 3) and then translated."""
        turn = np.eye(3) if rotation is None else rotation
        return Mesh(
            self.vertices_m @ turn.T + np.asarray(translation_m),
            self.normals @ turn.T,
            self.indices,
            self.uv,
        )

    @property
    def triangles(self) -> int:
        """The number of triangles: the cost of drawing it."""
        return len(self.indices) // 3


def merge(meshes: Iterable[Mesh]) -> Mesh:
    """Return one mesh of all triangles; the simulator then needs fewer bodies.

    The result has texture coordinates if every mesh has them.
    """
    parts = list(meshes)
    uvs = [part.uv for part in parts if part.uv is not None]
    offsets = np.cumsum([0, *(len(part.vertices_m) for part in parts[:-1])])
    return Mesh(
        np.concatenate([part.vertices_m for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.indices + at for part, at in zip(parts, offsets, strict=True)]),
        np.concatenate(uvs) if len(uvs) == len(parts) else None,
    )


def box(
    center_m: Sequence[float],
    size_m: Sequence[float],
    regions: Region | Mapping[str, Region] = WHOLE,
) -> Mesh:
    """Return an axis-aligned box with flat faces.

    Args:
        center_m: its centre.
        size_m: its extents along the axes.
        regions: the part of a texture on every face, or one part per face of :data:`BOX_FACES`.
            A mapping makes only the faces that it names, so hidden faces cost nothing.
    """
    vertices = _UNIT_BOX * (0.5 * np.asarray(size_m)) + np.asarray(center_m)
    if not isinstance(regions, Mapping):
        return Mesh(vertices, _BOX_NORMALS, _BOX_INDICES, _in_region(_BOX_UV, regions))
    faces = np.array([BOX_FACES.index(name) for name in regions])
    rows = (4 * faces[:, None] + np.arange(4)).ravel()
    uv = np.concatenate(
        [
            _in_region(_BOX_UV[4 * face : 4 * face + 4], region)
            for face, region in zip(faces, regions.values(), strict=True)
        ]
    )
    return Mesh(vertices[rows], _BOX_NORMALS[rows], _BOX_INDICES[: 6 * len(faces)], uv)


def quad(corners_m: Sequence[Sequence[float]], region: Region = WHOLE) -> Mesh:
    """Return a flat face of four corners, visible from the side where they run counter-clockwise.

    The texture's ``region`` reaches from the first corner (lower left) to the third.
    """
    corners = np.asarray(corners_m, dtype=np.float64)
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    unit = normal / np.linalg.norm(normal)
    return Mesh(
        corners, np.tile(unit, (4, 1)), np.array((0, 1, 2, 0, 2, 3)), _in_region(_QUAD_UV, region)
    )


def _in_region(uv: FloatArray, region: Region) -> FloatArray:
    """Return unit texture coordinates (N, 2) moved into a region of the texture."""
    u_min, v_min, u_max, v_max = region
    return np.asarray(np.array((u_min, v_min)) + uv * np.array((u_max - u_min, v_max - v_min)))


def read_meshes(data: bytes) -> dict[str, Mesh]:
    """Return the meshes by name in the bytes of an ``.npz`` file."""
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        names = [key.removesuffix(".indices") for key in arrays.files if key.endswith(".indices")]
        return {
            name: Mesh(*(arrays[f"{name}.{field.name}"] for field in fields(Mesh)))
            for name in names
        }


@dataclass(frozen=True, slots=True, eq=False)
class SceneryChunk:
    """A piece of scenery, small enough that a view can leave most chunks out.

    Attributes:
        mesh: in odom, with texture coordinates.
        colour: multiplies the texture.
        texture: a name for :func:`scenery_texture`; None shows the plain colour.
    """

    mesh: Mesh
    colour: Colour
    texture: str | None


#: Number of goods textures; a variant of the scenery uses one of them.
GOODS_SETS: Final = 4
#: Extent that a texture covers: side of a square of floor or ceiling, width of a piece of wall.
TILE_M: Final = 4.0
#: The names that :func:`scenery_texture` knows.
TEXTURE_NAMES: Final = (
    *(f"goods{k}" for k in range(GOODS_SETS)),
    "floor0",
    "floor1",
    "wall",
    "ceiling",
    "paint",
    "fixtures",
    "amr",
)
_FOLDER: Final = resources.files(__package__) / "textures"


@cache
def scenery_texture(name: str) -> NDArray[np.uint8]:
    """Return a texture (H, W, 3), its first row at v = 1; read-only, read once."""
    if name not in TEXTURE_NAMES:
        raise SimError(not_one_of("texture", name, TEXTURE_NAMES))
    data = np.frombuffer((_FOLDER / f"{name}.webp").read_bytes(), dtype=np.uint8)
    bgr = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)
    texture = np.ascontiguousarray(bgr[..., ::-1])
    texture.setflags(write=False)
    return texture


class Atlas:
    """A square texture of many small images, so that one mesh can show many materials.

    Args:
        size_px: side of the texture.
        cells_px: left, top, width and height of each image, from the texture's upper left corner.
    """

    def __init__(self, size_px: int, cells_px: Mapping[str, tuple[int, int, int, int]]) -> None:
        self.size_px = size_px
        self.cells_px = cells_px

    def region(self, name: str, part: Region = WHOLE) -> Region:
        """Return the texture coordinates of a cell, or of ``part`` of it.

        ``part`` counts u and v from 0 to 1, from the cell's lower left corner. The outermost half
        texel of a cell is left out, so the nearest texel always belongs to the cell.
        """
        left_px, top_px, width_px, height_px = self.cells_px[name]
        width, height = width_px - 1, height_px - 1
        left = left_px + 0.5
        bottom = self.size_px - top_px - height_px + 0.5
        return (
            (left + part[0] * width) / self.size_px,
            (bottom + part[1] * height) / self.size_px,
            (left + part[2] * width) / self.size_px,
            (bottom + part[3] * height) / self.size_px,
        )

    def count(self, kind: str) -> int:
        """Return how many cells of a kind there are: those named ``kind0``, ``kind1`` and so on."""
        return sum(cell.rstrip("0123456789") == kind != cell for cell in self.cells_px)

    def drawn(self, kind: str, rng: np.random.Generator) -> str:
        """Return the name of a random cell of a kind."""
        return f"{kind}{rng.integers(self.count(kind))}"


_ATLASES: Final = {
    name: Atlas(atlas["size_px"], {key: tuple(cell) for key, cell in atlas["cells_px"].items()})
    for name, atlas in parse_json(
        (_FOLDER / "atlases.json").read_bytes(), "atlases.json", SimError
    ).items()
}
#: Cells of the textures ``goods0``, ``goods1`` and so on, of ``paint`` and of ``fixtures``.
GOODS_ATLAS: Final = _ATLASES["goods"]
MARKING_ATLAS: Final = _ATLASES["paint"]
FIXTURE_ATLAS: Final = _ATLASES["fixtures"]
