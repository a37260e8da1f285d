"""The textures of halls and of the robot, with the named rectangles in them.

They are files beside this module: ``python -m training.hall`` paints them.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from awarenav.errors import not_one_of
from perception.documents import parse_json

from ..errors import SimError
from ._meshes import WHOLE, Region

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
    """Return a texture (H, W, 3), its first row at v = 1; read-only, read once.

    Raises:
        SimError: for a name that is not in :data:`TEXTURE_NAMES`.
    """
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

    Attributes:
        size_px: as given.
        cells_px: as given.
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
