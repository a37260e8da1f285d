"""Smaller textures: only the islands of a texture that a mesh uses.

PyBullet keeps a copy of the texture for every shape. A worker has about sixty shapes that share one
texture of three megabytes; cut to their own islands, they need a thirtieth of the memory.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from perception.arrays import FloatArray

# Texels kept around an island, for renderers that blend neighbouring texels.
_MARGIN: Final = 2
# A cut texture with more than this share of the original's texels is not worth it.
_MAX_SHARE: Final = 0.7
# The width of a cut texture is a multiple of this, so that a row has whole 32-bit words.
_ROW_TEXELS: Final = 4

Texture = NDArray[np.uint8]


def cut_texture(
    uv: FloatArray, indices: NDArray[np.int64], texture: Texture
) -> tuple[FloatArray, Texture]:
    """Return texture coordinates (N, 2) and a smaller texture that look the same on the mesh.

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
    return (
        np.stack([moved[:, 0] / sheet_width, 1.0 - moved[:, 1] / sheet_height], axis=1),
        sheet,
    )


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
