"""Small pictures packed into one texture, so that one body can show many materials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ._meshes import Region


@dataclass(frozen=True, slots=True)
class AtlasCell:
    """A rectangle of an atlas in pixels from its upper left corner."""

    left_px: int
    top_px: int
    width_px: int
    height_px: int


class Atlas:
    """Where each named picture lies in a square texture.

    Args:
        size_px: side of the texture.
        sizes_px: width and height of each picture; they are packed in rows, in this order.

    Attributes:
        size_px: as given.
        cells: the place of each picture.

    Raises:
        ValueError: where the pictures do not fit.
    """

    def __init__(self, size_px: int, sizes_px: Mapping[str, tuple[int, int]]) -> None:
        self.size_px = size_px
        self.cells: dict[str, AtlasCell] = {}
        left = top = tallest = 0
        for name, (width, height) in sizes_px.items():
            if left + width > size_px:
                left, top, tallest = 0, top + tallest, 0
            if top + height > size_px or width > size_px:
                raise ValueError(f"picture {name!r} no longer fits into an atlas of {size_px} px")
            self.cells[name] = AtlasCell(left, top, width, height)
            left += width
            tallest = max(tallest, height)

    def region(
        self,
        name: str,
        part: Region = (0.0, 0.0, 1.0, 1.0),
    ) -> Region:
        """Texture coordinates of a picture, or of a part of it (u, v from its lower left corner).

        The outermost half texel is left out: the nearest texel is then always one of the picture.
        """
        cell = self.cells[name]
        width, height = cell.width_px - 1, cell.height_px - 1
        left = cell.left_px + 0.5
        bottom = self.size_px - cell.top_px - cell.height_px + 0.5
        return (
            (left + part[0] * width) / self.size_px,
            (bottom + part[1] * height) / self.size_px,
            (left + part[2] * width) / self.size_px,
            (bottom + part[3] * height) / self.size_px,
        )
