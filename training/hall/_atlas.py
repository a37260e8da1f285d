"""Texture atlases: small images packed into one texture, so one mesh can show many materials."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from sim_tests.world.hall import Atlas

from ._canvas import Canvas, Rgb, finished, plain


class PaintedAtlas(Atlas):
    """A square texture of many small images, which are painted one after another.

    Args:
        size_px: side of the texture.
        sizes_px: width and height of each cell; the cells are packed in rows, in this order.

    Raises:
        ValueError: when the cells do not fit.
    """

    def __init__(self, size_px: int, sizes_px: Mapping[str, tuple[int, int]]) -> None:
        cells: dict[str, tuple[int, int, int, int]] = {}
        left = top = tallest = 0
        for name, (width, height) in sizes_px.items():
            if left + width > size_px:
                left, top, tallest = 0, top + tallest, 0
            if top + height > size_px or width > size_px:
                raise ValueError(f"cell {name!r} does not fit into an atlas of {size_px} px")
            cells[name] = left, top, width, height
            left += width
            tallest = max(tallest, height)
        super().__init__(size_px, cells)

    def painted(
        self, background: Rgb, paint: Callable[[Canvas, str, int], None]
    ) -> NDArray[np.uint8]:
        """Return the texture (size, size, 3), read-only.

        Args:
            background: colour of the gaps, and of every cell before it is painted.
            paint: called for one cell after another with its canvas, its name and its number.
        """
        texture = plain(self.size_px, self.size_px, background)
        for number, (name, (left, top, width, height)) in enumerate(self.cells_px.items()):
            canvas = plain(width, height, background)
            paint(canvas, name, number)
            texture[top : top + height, left : left + width] = canvas
        return finished(texture)
