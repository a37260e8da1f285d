"""All textures by name, and the places of the cells in those that are atlases."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ._atlas import PaintedAtlas
from ._building import (
    FIXTURE_ATLAS,
    MARKING_ATLAS,
    ceiling_texture,
    fixture_texture,
    floor_texture,
    marking_texture,
    wall_texture,
)
from ._goods import GOODS_ATLAS, goods_texture
from ._robot import amr_texture

_GOODS_SETS: Final = 4
_FLOORS: Final = 2
_ATLASES: Final[dict[str, PaintedAtlas]] = {
    "goods": GOODS_ATLAS,
    "paint": MARKING_ATLAS,
    "fixtures": FIXTURE_ATLAS,
}


def textures() -> Iterator[tuple[str, NDArray[np.uint8]]]:
    """Yield the name and the texels (H, W, 3) of every texture."""
    for k in range(_GOODS_SETS):
        yield f"goods{k}", goods_texture(k)
    for k in range(_FLOORS):
        yield f"floor{k}", floor_texture(k)
    yield "wall", wall_texture()
    yield "ceiling", ceiling_texture()
    yield "paint", marking_texture()
    yield "fixtures", fixture_texture()
    yield "amr", amr_texture()


def atlases() -> dict[str, Any]:
    """Return the size of every atlas and left, top, width, height of each of its cells, pixels."""
    return {
        name: {
            "size_px": atlas.size_px,
            "cells_px": {name: list(cell) for name, cell in atlas.cells_px.items()},
        }
        for name, atlas in _ATLASES.items()
    }
