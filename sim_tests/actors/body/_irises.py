"""Irises of human size on the eyeballs of the finest level of detail.

The body model's eyeballs are larger than human ones: 16 instead of 12 mm in radius. The irises of
the shipped textures grew with them, to 14 mm, and fill the gap between the lids: whether such an
eye looks aside can hardly be seen. Painted anew, an iris has the 11.7 mm of human ones, which vary
by 4 % only, and its own colour.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

#: Radius of a human iris, and of the parts of its picture.
IRIS_RADIUS_M: Final = 5.85e-3
_RIM_WIDTH_M: Final = 0.7e-3
_PUPIL_RADIUS_M: Final = 2.2e-3
# Highlight of a lamp: left and up from the axis, and its radius.
_GLINT_M: Final = (1.6e-3, 2.0e-3)
_GLINT_RADIUS_M: Final = 0.9e-3
# Sines of the angles to the eye's axis between which the old picture shows the colour of the iris,
# and of the white, which lies partly in shadow.
_OLD_IRIS: Final = (0.25, 0.40)
_OLD_WHITE: Final = (0.58, 0.90)
# Shadow of the upper lid on the white: its largest share, and the heights where it begins and ends.
_LID_SHADE: Final = 0.22
_LID_SHADE_M: Final = (2e-3, 8e-3)
_PUPIL_GREY, _GLINT_GREY = 12.0, 250.0
_RIM_SHARE: Final = 0.55
# A triangle is painted this many texels beyond its edges, because renderers interpolate.
_MARGIN_PX: Final = 1.0


@dataclass(frozen=True, slots=True)
class _Texels:
    """Texels of an eyeball: rows and columns (N,), and places (N, 3) from the eyeball's centre."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    places_m: FloatArray


def with_human_irises(
    texture_rgb: NDArray[np.uint8],
    vertices_m: FloatArray,
    uv: FloatArray,
    triangles: NDArray[np.int64],
    eyes: tuple[tuple[FloatArray, NDArray[np.bool_]], ...],
) -> NDArray[np.uint8]:
    """Return a copy of a texture with the irises painted anew; all else is equal to the bit.

    Args:
        texture_rgb: (H, W, 3).
        vertices_m: (V, 3) at rest: x ahead, y left, z up.
        uv: (V, 2), (0, 0) at the lower left of the texture.
        triangles: (T, 3).
        eyes: of each eye, the centre (3,) and which of the (V,) vertices belong to it.
    """
    painted: NDArray[np.uint8] = texture_rgb.copy()
    for centre_m, is_eye in eyes:
        shown = triangles[is_eye[triangles].all(axis=1)]
        if len(shown):
            parts = list(_texels(texture_rgb.shape[:2], vertices_m - centre_m, uv, shown))
            texels = _Texels(
                np.concatenate([part.rows for part in parts]),
                np.concatenate([part.columns for part in parts]),
                np.concatenate([part.places_m for part in parts]),
            )
            _paint(painted, texture_rgb, texels)
    return painted


def _texels(
    shape: tuple[int, ...], places_m: FloatArray, uv: FloatArray, triangles: NDArray[np.int64]
) -> Iterator[_Texels]:
    """Yield the texels of each triangle, with a margin."""
    height, width = shape
    # The first row of a texture lies at v = 1; centres of texels at whole numbers.
    pixels = np.column_stack([uv[:, 0] * width, (1.0 - uv[:, 1]) * height]) - 0.5
    for triangle in triangles:
        corner = pixels[triangle]
        sides = np.column_stack([corner[1] - corner[0], corner[2] - corner[0]])
        area = abs(float(np.linalg.det(sides)))
        if area < 1e-6:
            continue
        low = np.maximum(np.floor(corner.min(axis=0) - _MARGIN_PX), 0).astype(int)
        high = np.ceil(corner.max(axis=0) + _MARGIN_PX).astype(int) + 1
        columns, rows = np.meshgrid(
            np.arange(low[0], min(high[0], width)), np.arange(low[1], min(high[1], height))
        )
        at = np.stack([columns.ravel() - corner[0, 0], rows.ravel() - corner[0, 1]])
        share = np.linalg.solve(sides, at)
        share = np.vstack([1.0 - share.sum(axis=0), share])
        opposite = np.linalg.norm(np.roll(corner, 1, axis=0) - np.roll(corner, -1, axis=0), axis=1)
        # A share times the triangle's height over that edge is the distance from it.
        inside = (share * (area / opposite)[:, None] >= -_MARGIN_PX).all(axis=0)
        yield _Texels(
            rows.ravel()[inside], columns.ravel()[inside], share.T[inside] @ places_m[triangle]
        )


def _paint(painted: NDArray[np.uint8], old: NDArray[np.uint8], texels: _Texels) -> None:
    """Paint one eyeball in the colours that it has."""
    x, y, z = texels.places_m.T
    off = np.hypot(y, z)
    sine = off / np.linalg.norm(texels.places_m, axis=1)

    def old_colour(low: float, high: float, percentile: float) -> FloatArray:
        chosen = (x > 0.0) & (sine > low) & (sine < high)
        colours = old[texels.rows[chosen], texels.columns[chosen]]
        return np.asarray(np.percentile(colours, percentile, axis=0), dtype=np.float64)

    iris = old_colour(*_OLD_IRIS, percentile=50.0)
    t = np.clip((z - _LID_SHADE_M[0]) / (_LID_SHADE_M[1] - _LID_SHADE_M[0]), 0.0, 1.0)
    shade = 1.0 - _LID_SHADE * t * t * (3.0 - 2.0 * t)
    rgb = old_colour(*_OLD_WHITE, percentile=90.0) * shade[:, None]
    front = x > 0.0
    rgb[front & (off < IRIS_RADIUS_M)] = _RIM_SHARE * iris
    rgb[front & (off < IRIS_RADIUS_M - _RIM_WIDTH_M)] = iris
    rgb[front & (off < _PUPIL_RADIUS_M)] = _PUPIL_GREY
    rgb[front & (np.hypot(y - _GLINT_M[0], z - _GLINT_M[1]) < _GLINT_RADIUS_M)] = _GLINT_GREY
    painted[texels.rows, texels.columns] = np.rint(rgb).astype(np.uint8)
