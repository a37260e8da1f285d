"""The renderer ``"tiny"``: PyBullet's software renderer, on every platform that PyBullet has."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ..bullet import pybullet
from ..errors import SimError
from ..hall import Colour, Lighting, Mesh
from ._backend import BackendName, Drawing, RenderBackend, RenderView, texture_key

# The last half metre before the far plane counts as nothing: float32 depth is coarse there.
_FAR_MARGIN_M: Final = 0.5
# The renderer samples column i at i / width of the frustum and, since the image is flipped, row j
# at (j + 1) / height from the top. This shift moves the samples to the middles of the cells.
_SHIFT_SAMPLES: Final = (0.5, -0.5)
# A vertex exactly in the camera's plane has no image; the renderer draws its triangles anywhere.
# Halls have many corners at round coordinates, so a camera along an odom axis is moved a little.
_ALONG_AXIS: Final = 1.0 - 1e-9
_NUDGE_M: Final = 1.37e-4

# Texels kept around an island of a cut texture, for renderers that blend neighbouring texels.
_MARGIN: Final = 2
# A cut texture with more than this share of the original's texels is not worth it.
_MAX_SHARE: Final = 0.7
# The width of a cut texture is a multiple of this, so that a row has whole 32-bit words.
_ROW_TEXELS: Final = 4

Texture = NDArray[np.uint8]


class TinyBackend(RenderBackend):
    """See :class:`RenderBackend`: a PyBullet client of its own holds the bodies."""

    name: BackendName = "tiny"

    def __init__(self) -> None:
        self._client: int = pybullet.connect(pybullet.DIRECT)
        if self._client < 0:
            raise SimError("PyBullet could not start another render world")
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._textures: list[Texture] = []
        # PyBullet's numbers of the cut textures by content.
        self._loaded: dict[bytes, int] = {}
        self._colours: list[Colour] = []

    def close(self) -> None:
        """End the client."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def texture(self, rgb: Texture) -> int:
        """Register a texture (H, W, 3); PyBullet loads the parts of it that bodies use."""
        self._textures.append(rgb)
        return len(self._textures) - 1

    def _load(self, rgb: Texture) -> int:
        """Return PyBullet's number of a texture; equal textures are loaded once."""
        key = texture_key(rgb)
        if key in self._loaded:
            return self._loaded[key]
        # PyBullet takes textures from files only; this format is the fastest to write and to read.
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="awarenav-")
        path = Path(self._folder.name) / f"{len(self._loaded)}.bmp"
        if not cv2.imwrite(str(path), np.ascontiguousarray(rgb[..., ::-1])):
            raise SimError(f"cannot write the texture {path.name}")
        number = int(pybullet.loadTexture(str(path), physicsClientId=self._client))
        path.unlink()
        if number < 0:
            raise SimError(f"PyBullet did not take a texture of shape {rgb.shape}")
        self._loaded[key] = number
        return number

    def add_body(self, mesh: Mesh, colour: Colour, texture: int | None) -> int:
        """Make a body whose texture is cut to the parts that its mesh shows."""
        uv, number = mesh.uv, None
        if texture is not None and uv is not None:
            uv, rgb = cut_texture(uv, mesh.indices.ravel(), self._textures[texture])
            number = self._load(rgb)
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=mesh.vertices_m.tolist(),
            indices=mesh.indices.ravel().tolist(),
            normals=mesh.normals.tolist(),
            rgbaColor=[*colour, 1.0],
            specularColor=[0.0, 0.0, 0.0],
            physicsClientId=self._client,
            **({} if uv is None else {"uvs": uv.tolist()}),
        )
        body: int = pybullet.createMultiBody(
            0.0, -1, shape, useMaximalCoordinates=True, physicsClientId=self._client
        )
        if number is not None:
            pybullet.changeVisualShape(
                body, -1, textureUniqueId=number, physicsClientId=self._client
            )
        self._colours.append(colour)
        return body

    def place(self, bodies: Sequence[int], T_odom_bodies: FloatArray) -> None:
        """Move bodies."""
        if not len(bodies):
            return
        positions = T_odom_bodies[:, :3, 3].tolist()
        turns = Rotation.from_matrix(T_odom_bodies[:, :3, :3]).as_quat().tolist()
        for body, position, turn in zip(bodies, positions, turns, strict=True):
            pybullet.resetBasePositionAndOrientation(
                body, position, turn, physicsClientId=self._client
            )

    def hide(self, body: int) -> None:
        """Make a body fully transparent: the renderer skips it, at 0.06 µs per image."""
        self._set_opacity(body, 0.0)

    def reveal(self, body: int) -> None:
        """Make a body opaque again."""
        self._set_opacity(body, 1.0)

    def _set_opacity(self, body: int, opacity: float) -> None:
        pybullet.changeVisualShape(
            body, -1, rgbaColor=(*self._colours[body], opacity), physicsClientId=self._client
        )

    def draw(self, view: RenderView, light: Lighting) -> Drawing:
        """Draw the view as if the light were white."""
        width, height = view.width, view.height
        _, _, rgba, depth, bodies = pybullet.getCameraImage(
            width,
            height,
            _nudged_view_matrix(view),
            view.projection_matrix(_SHIFT_SAMPLES),
            lightDirection=light.direction_odom,
            lightColor=(1.0, 1.0, 1.0),
            lightAmbientCoeff=light.ambient,
            lightDiffuseCoeff=light.diffuse,
            lightSpecularCoeff=light.specular,
            shadow=0,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        near, far = view.near_m, view.far_m
        buffer = np.asarray(depth, dtype=np.float64).reshape(height, width)
        depth_m = far * near / (far - (far - near) * buffer)
        depth_m[depth_m > far - _FAR_MARGIN_M] = np.inf
        return Drawing(
            np.ascontiguousarray(
                np.asarray(rgba, dtype=np.uint8).reshape(height, width, 4)[..., :3]
            ),
            depth_m,
            np.asarray(bodies, dtype=np.int32).reshape(height, width),
        )


def _nudged_view_matrix(view: RenderView) -> list[float]:
    """Return the view matrix, moved along the optical axis if that lies along an axis of odom."""
    matrix = view.view_matrix()
    if float(np.abs(view.T_odom_camera[:3, 2]).max()) > _ALONG_AXIS:
        matrix[14] += _NUDGE_M
    return matrix


def cut_texture(
    uv: FloatArray, indices: NDArray[np.int64], texture: Texture
) -> tuple[FloatArray, Texture]:
    """Return texture coordinates (N, 2) and a smaller texture that look the same on the mesh.

    PyBullet keeps a copy of the texture for every shape. A worker has about sixty shapes that share
    one texture of three megabytes; cut to their own islands, they need a thirtieth of the memory.

    Each connected part of the mesh keeps the rectangle of texels that it covers. Equal rectangles
    are kept once; all are packed in rows. Coordinates outside [0, 1] repeat the texture: both are
    then returned unchanged.

    Args:
        uv: (N, 2), (0, 0) at the texture's lower left.
        indices: (3 T,) rows of ``uv``, three per triangle.
        texture: (H, W, 3).
    """
    height, width = texture.shape[:2]
    if uv.min(initial=0.0) < 0.0 or uv.max(initial=0.0) > 1.0 or not len(indices):
        return uv, texture
    island = _islands(len(uv), indices)
    texels = np.stack([uv[:, 0] * width, (1.0 - uv[:, 1]) * height], axis=1)
    count = int(island.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, island, texels)
    np.maximum.at(high, island, texels)
    # Faces with the same rectangle share it.
    rectangles, rectangle_of = np.unique(
        np.concatenate(
            [
                np.maximum(np.floor(low).astype(int) - _MARGIN, 0),
                np.minimum(np.floor(high).astype(int) + 1 + _MARGIN, (width, height)),
            ],
            axis=1,
        ),
        axis=0,
        return_inverse=True,
    )
    first, last = rectangles[:, :2], rectangles[:, 2:]
    size = last - first
    corner, sheet_width, sheet_height = _packed(size)
    if sheet_width * sheet_height > _MAX_SHARE * width * height:
        return uv, texture
    sheet = np.zeros((sheet_height, sheet_width, 3), np.uint8)
    for (u0, v0), (u1, v1), (x, y) in zip(
        first.tolist(), last.tolist(), corner.tolist(), strict=True
    ):
        sheet[y : y + v1 - v0, x : x + u1 - u0] = texture[v0:v1, u0:u1]
    moved = texels + (corner - first)[rectangle_of.ravel()[island]]
    return (np.stack([moved[:, 0] / sheet_width, 1.0 - moved[:, 1] / sheet_height], axis=1), sheet)


def _islands(vertices: int, indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (N,) the number of the connected part that each vertex belongs to."""
    a, b, c = indices.reshape(-1, 3).T
    edges = coo_array(
        (np.ones(2 * len(a), dtype=bool), (np.concatenate([a, b]), np.concatenate([b, c]))),
        shape=(vertices, vertices),
    )
    return np.asarray(connected_components(edges, directed=False)[1], dtype=np.int64)


def _packed(size: NDArray[np.int64]) -> tuple[NDArray[np.int64], int, int]:
    """Return the corners (K, 2) of rectangles (K, 2) packed in rows, and the sheet's size.

    The tallest rectangles come first.
    """
    sheet_width = max(int(size[:, 0].max()), math.ceil(1.1 * math.sqrt(float(size.prod(1).sum()))))
    corner = np.zeros_like(size)
    x = y = row_height = 0
    for number in np.lexsort((size[:, 0], -size[:, 1])).tolist():
        width, height = size[number].tolist()
        if x + width > sheet_width:
            x, y, row_height = 0, y + row_height, 0
        corner[number] = x, y
        x, row_height = x + width, max(row_height, height)
    used = int((corner + size)[:, 0].max())
    return corner, used + -used % _ROW_TEXELS, y + row_height
