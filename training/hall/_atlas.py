"""Texture atlases: small images packed into one texture, so one mesh can show many materials."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._canvas import Canvas, Rgb, finished, plain


@dataclass(frozen=True, slots=True)
class AtlasCell:
    """A rectangle of an atlas, in pixels from its upper left corner."""

    left_px: int
    top_px: int
    width_px: int
    height_px: int


class Atlas:
    """The layout of a square texture that is divided into named cells.

    Args:
        size_px: side of the texture.
        sizes_px: width and height of each cell; the cells are packed in rows, in this order.

    Attributes:
        size_px: as given.
        cells: the place of each cell by its name.

    Raises:
        ValueError: when the cells do not fit.
    """

    def __init__(self, size_px: int, sizes_px: Mapping[str, tuple[int, int]]) -> None:
        self.size_px = size_px
        self.cells: dict[str, AtlasCell] = {}
        left = top = tallest = 0
        for name, (width, height) in sizes_px.items():
            if left + width > size_px:
                left, top, tallest = 0, top + tallest, 0
            if top + height > size_px or width > size_px:
                raise ValueError(f"cell {name!r} does not fit into an atlas of {size_px} px")
            self.cells[name] = AtlasCell(left, top, width, height)
            left += width
            tallest = max(tallest, height)

    def painted(
        self, background: Rgb, paint: Callable[[Canvas, str, int], None]
    ) -> NDArray[np.uint8]:
        """Return the texture (size, size, 3), read-only.

        Args:
            background: colour of the gaps, and of every cell before it is painted.
            paint: called for one cell after another with its canvas, its name and its number.
        """
        texture = plain(self.size_px, self.size_px, background)
        for number, (name, cell) in enumerate(self.cells.items()):
            canvas = plain(cell.width_px, cell.height_px, background)
            paint(canvas, name, number)
            bottom, right = cell.top_px + cell.height_px, cell.left_px + cell.width_px
            texture[cell.top_px : bottom, cell.left_px : right] = canvas
        return finished(texture)
