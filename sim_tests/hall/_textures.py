"""Every texture of the scenery by name, painted on first use and kept."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .._errors import SimError
from .._names import not_one_of
from ._texture_amr import amr_texture
from ._texture_goods import GOODS_SETS, goods_texture
from ._texture_hall import (
    ceiling_texture,
    fixture_texture,
    floor_texture,
    paint_texture,
    wall_texture,
)

_MAKERS: Final[dict[str, Callable[[], NDArray[np.uint8]]]] = {
    **{f"goods{k}": partial(goods_texture, k) for k in range(GOODS_SETS)},
    **{f"floor{k}": partial(floor_texture, k) for k in range(2)},
    "wall": wall_texture,
    "ceiling": ceiling_texture,
    "paint": paint_texture,
    "fixtures": fixture_texture,
    "amr": amr_texture,
}

TEXTURE_NAMES: Final = tuple(_MAKERS)


@cache
def scenery_texture(name: str) -> NDArray[np.uint8]:
    """The picture (H, W, 3) of a texture, row 0 at v = 1; read-only, the same bytes every time.

    Raises:
        SimError: for a name that is not in :data:`TEXTURE_NAMES`.
    """
    if name not in _MAKERS:
        raise SimError(not_one_of("texture", name, TEXTURE_NAMES))
    return _MAKERS[name]()
