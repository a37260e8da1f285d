"""The scenery of a hall as the camera sees it: every mesh in chunks, every texture by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, lru_cache, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from awarenav.errors import not_one_of

from ..errors import SimError
from ._layout import WarehouseLayout
from ._meshes import SceneryChunk
from ._scenery_hall import ceiling_chunks, floor_chunks, wall_chunks
from ._scenery_markings import marking_chunks
from ._scenery_props import prop_chunk
from ._scenery_racks import rack_chunks
from ._texture_amr import amr_texture
from ._texture_goods import GOODS_SETS, goods_texture
from ._texture_hall import (
    ceiling_texture,
    fixture_texture,
    floor_texture,
    marking_texture,
    wall_texture,
)

_TEXTURES: Final[dict[str, Callable[[], NDArray[np.uint8]]]] = {
    **{f"goods{k}": partial(goods_texture, k) for k in range(GOODS_SETS)},
    **{f"floor{k}": partial(floor_texture, k) for k in range(2)},
    "wall": wall_texture,
    "ceiling": ceiling_texture,
    "paint": marking_texture,
    "fixtures": fixture_texture,
    "amr": amr_texture,
}

#: The names that :func:`scenery_texture` knows.
TEXTURE_NAMES: Final = tuple(_TEXTURES)


@cache
def scenery_texture(name: str) -> NDArray[np.uint8]:
    """Return a texture (H, W, 3), its first row at v = 1; read-only, the same bytes every time.

    It is painted on first use and kept.

    Raises:
        SimError: for a name that is not in :data:`TEXTURE_NAMES`.
    """
    if name not in _TEXTURES:
        raise SimError(not_one_of("texture", name, TEXTURE_NAMES))
    return _TEXTURES[name]()


@lru_cache(maxsize=8)  # many episodes use the same hall
def scenery(layout: WarehouseLayout, variant: int = 0) -> tuple[SceneryChunk, ...]:
    """Return the chunks that a hall is drawn from; the same arguments give the same bytes.

    Chunks that usually hide others come first, so a renderer with a depth buffer shades fewer
    pixels twice.

    Args:
        layout: the hall.
        variant: chooses goods, prints, tones and wall fixtures; a whole number ≥ 0.

    Raises:
        SimError: for a variant that is not a whole number ≥ 0.
    """
    if isinstance(variant, bool) or not isinstance(variant, int) or variant < 0:
        raise SimError(f"variant must be a whole number of at least 0, got {variant!r}")
    return (
        *(
            chunk
            for number, rack in enumerate(layout.racks)
            for chunk in rack_chunks(rack, number, variant)
        ),
        *(prop_chunk(prop, number, variant) for number, prop in enumerate(layout.props)),
        *wall_chunks(layout, variant),
        *marking_chunks(layout, variant),
        *floor_chunks(layout, variant),
        *ceiling_chunks(layout),
    )
