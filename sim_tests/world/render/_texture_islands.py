"""Cuts from a texture what a mesh uses of it, since PyBullet keeps a copy with every shape.

A worker is some sixty shapes that share one picture of three megabytes; with their own pieces of it
they take a thirtieth of the memory and look the same.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from perception.arrays import FloatArray

# Texels around an island that come along, for renderers that blend neighbours.
_MARGIN: Final = 2
# Cutting is not worth while for less than this saving.
_WORTH: Final = 0.7

# Rows of a whole number of 32-bit words are what graphics hardware takes as it is.
_ROW_TEXELS: Final = 4

Image = NDArray[np.uint8]


def cut_texture(
    uv: FloatArray, indices: NDArray[np.int64], picture: Image
) -> tuple[FloatArray, Image]:
    """Return texture coordinates (N, 2) and a smaller picture that look the same on the mesh.

    Each connected part of the mesh keeps the rectangle of texels that it covers; the rectangles,
    equal ones once, are packed in rows. Coordinates outside [0, 1], which repeat the picture, leave
    both as they are.

    Args:
        uv: (N, 2), (0, 0) at the picture's lower left.
        indices: (3 T,) rows of ``uv``, three a triangle.
        picture: (H, W, 3).
    """
    height, width = picture.shape[:2]
    if uv.min(initial=0.0) < 0.0 or uv.max(initial=0.0) > 1.0 or not len(indices):
        return uv, picture
    island = _islands(len(uv), indices)
    texels = np.stack([uv[:, 0] * width, (1.0 - uv[:, 1]) * height], axis=1)
    count = int(island.max()) + 1
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, island, texels)
    np.maximum.at(high, island, texels)
    # Faces that show the same thing share its rectangle.
    rectangles, which = np.unique(
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
    if sheet_width * sheet_height > _WORTH * width * height:
        return uv, picture
    sheet = np.zeros((sheet_height, sheet_width, 3), np.uint8)
    for (u0, v0), (u1, v1), (x, y) in zip(
        first.tolist(), last.tolist(), corner.tolist(), strict=True
    ):
        sheet[y : y + v1 - v0, x : x + u1 - u0] = picture[v0:v1, u0:u1]
    moved = texels + (corner - first)[which.ravel()[island]]
    return (
        np.stack([moved[:, 0] / sheet_width, 1.0 - moved[:, 1] / sheet_height], axis=1),
        sheet,
    )


def _islands(vertices: int, indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) number of the connected part that each vertex belongs to."""
    a, b, c = indices.reshape(-1, 3).T
    edges = coo_array(
        (np.ones(2 * len(a), dtype=bool), (np.concatenate([a, b]), np.concatenate([b, c]))),
        shape=(vertices, vertices),
    )
    return np.asarray(connected_components(edges, directed=False)[1], dtype=np.int64)


def _packed(size: NDArray[np.int64]) -> tuple[NDArray[np.int64], int, int]:
    """Corners (K, 2) of rectangles (K, 2) laid in rows, tallest first; width and height of all."""
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
