"""The textures of racks, goods and props: cartons, pallets, film, crates, steel, signs."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ._atlas import PaintedAtlas
from ._canvas import Canvas, Rgb, grain
from ._goods_painters import GOODS_PAINTERS

# Number of cells of each kind in the atlas.
_CARTONS: Final = 8
_STACKS: Final = 10
_WRAPS: Final = 4
_CRATES: Final = 5
_SIGNS: Final = 12

_MATERIALS: Final[dict[str, Rgb]] = {
    "steel": (138, 142, 146),
    "dark": (52, 54, 58),
    "rubber": (38, 38, 40),
    "red": (176, 44, 36),
    "yellow": (226, 178, 34),
    "blue": (42, 78, 142),
    "green": (48, 112, 70),
    "orange": (214, 106, 30),
    "grey": (150, 152, 152),
    "white": (224, 224, 218),
    "wood": (168, 134, 92),
    "lamp": (255, 255, 255),
}

GOODS_ATLAS: Final = PaintedAtlas(
    1024,
    {
        **{f"stack{k}": (128, 128) for k in range(_STACKS)},
        **{f"wrap{k}": (128, 128) for k in range(_WRAPS)},
        **{f"crates{k}": (128, 128) for k in range(_CRATES)},
        "sacks0": (128, 128),
        "sacks1": (128, 128),
        "drums0": (128, 128),
        "drums1": (128, 128),
        "backing": (128, 128),
        "cage0": (128, 128),
        "cage1": (128, 128),
        "parts": (128, 128),
        "end": (64, 256),
        "upright": (16, 256),
        "ladder": (64, 256),
        **{f"carton{k}": (96, 96) for k in range(_CARTONS)},
        "window": (96, 64),
        "deck": (96, 64),
        **{f"top{k}": (64, 64) for k in range(4)},
        "pallet_top": (128, 64),
        "wrap_top": (64, 64),
        "crates_top": (64, 64),
        "mast": (64, 64),
        **{f"sign{k}": (64, 32) for k in range(_SIGNS)},
        "hazard": (128, 32),
        "beam": (128, 16),
        "pallet_side": (128, 20),
        "grille": (64, 32),
        "label": (32, 14),
        **dict.fromkeys(_MATERIALS, (16, 16)),
    },
)


def goods_texture(variant: int) -> NDArray[np.uint8]:
    """Return the texture (1024, 1024, 3) of :data:`GOODS_ATLAS`.

    ``variant`` seeds the tones, prints and arrangements.
    """

    def paint(canvas: Canvas, name: str, number: int) -> None:
        rng = np.random.default_rng((20260, variant, number))
        if name in _MATERIALS:
            canvas[:] = _MATERIALS[name]
            grain(canvas, rng, 0.0 if name == "lamp" else 0.02)
        else:
            kind = name.rstrip("0123456789")
            GOODS_PAINTERS[kind](canvas, rng, int(name[len(kind) :] or 0))

    return GOODS_ATLAS.painted((128, 128, 128), paint)
