"""What lies on a pallet: cartons, film, crates, sacks, drums."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, Literal

import numpy as np

from ._meshes import Mesh, box
from ._texture_goods import CARTONS, CRATES, GOODS_ATLAS, STACKS, WRAPS

#: ``"cartons"`` of one kind, perhaps one more on top, two ``"heaps"`` of different cartons,
#: ``"pallets"`` without goods, ``"nothing"`` at all, or what the word says.
Load = Literal["cartons", "heaps", "wrapped", "crates", "sacks", "drums", "pallets", "nothing"]

#: Height of a euro pallet and of the sliver of air above it.
PALLET_M: Final = 0.148
_WOOD_M: Final = 0.144
_MOST_PALLETS_M: Final = 1.06
_MOST_DRUM_M: Final = 0.9
_TOPS: Final = {"wrapped": "wrap_top", "crates": "crates_top", "sacks": "wrap_top", "drums": "dark"}
# How much of the room each load takes at least.
_LEAST: Final = {"wrapped": 0.8, "crates": 0.6, "sacks": 0.45, "drums": 0.8}
_SIDES: Final = ("-x", "+x", "-y", "+y")

_at = GOODS_ATLAS.region


def pallet_load(
    load: Load,
    foot_m: tuple[float, float, float],
    size_m: tuple[float, float],
    room_m: float,
    rng: np.random.Generator,
) -> Iterator[Mesh]:
    """A pallet with goods.

    Args:
        load: what lies on it.
        foot_m: the middle of its underside.
        size_m: of the pallet along x and y.
        room_m: pallet and goods are together at most so high.
        rng: draws heights and prints.
    """
    if load == "nothing":
        return
    x, y, z = foot_m
    if load == "pallets":
        count = max(1, math.floor(min(room_m, _MOST_PALLETS_M) / PALLET_M))
        yield from pallets(count, foot_m, size_m)
        return
    yield from pallets(1, foot_m, size_m)
    base, tall = z + PALLET_M, max(room_m - PALLET_M, 0.1)
    wide, deep = size_m[0] - 0.04, size_m[1] - 0.04
    if load == "cartons":
        full = tall * float(rng.uniform(0.55, 1.0))
        number = int(rng.integers(STACKS))
        yield goods_box((x, y, base), (wide, deep, full), f"stack{number}", f"top{number % 4}")
        if full < 0.72 * tall:
            edge = min(0.42, tall - full, 0.5 * wide)
            aside = float(rng.choice((-1.0, 1.0))) * (0.5 * (wide - edge) - 0.02)
            one = f"carton{rng.integers(CARTONS)}"
            high = edge * float(rng.uniform(0.7, 1.0))
            yield goods_box((x + aside, y, base + full), (edge, 0.86 * deep, high), one, "top0")
    elif load == "heaps":
        split = float(rng.uniform(0.42, 0.58))
        for share, middle in ((split, 0.5 * (split - 1.0)), (1.0 - split, 0.5 * split)):
            full = tall * float(rng.uniform(0.45, 0.95))
            several = full >= 0.7
            name = f"stack{rng.integers(STACKS)}" if several else f"carton{rng.integers(CARTONS)}"
            size = (share * wide - 0.015, deep, full)
            yield goods_box((x + middle * wide, y, base), size, name, "top1")
    else:
        full = tall * float(rng.uniform(_LEAST[load], 1.0))
        if load == "drums":
            full = min(full, _MOST_DRUM_M)
        yield goods_box((x, y, base), (wide, deep, full), picture_of(load, rng), _TOPS[load])


def picture_of(load: Load, rng: np.random.Generator) -> str:
    """Name of a picture in the atlas that shows such a load from the side."""
    kinds = {
        "cartons": ("stack", STACKS),
        "heaps": ("stack", STACKS),
        "wrapped": ("wrap", WRAPS),
        "crates": ("crates", CRATES),
        "sacks": ("sacks", 2),
        "drums": ("drums", 2),
    }
    name, count = kinds[load]
    return f"{name}{rng.integers(count)}"


def pallets(
    count: int, foot_m: tuple[float, float, float], size_m: tuple[float, float]
) -> Iterator[Mesh]:
    """Empty pallets on top of each other."""
    x, y, z = foot_m
    for k in range(count):
        regions = {name: _at("pallet_side") for name in _SIDES}
        if k == count - 1:
            regions["+z"] = _at("pallet_top")
        yield box((x, y, z + (k + 0.5) * PALLET_M), (*size_m, _WOOD_M), regions)


def goods_box(
    foot_m: tuple[float, float, float], size_m: tuple[float, float, float], side: str, top: str
) -> Mesh:
    """A box that stands on ``foot_m``: one picture on its sides, another on top, none below."""
    x, y, z = foot_m
    regions = {name: _at(side) for name in _SIDES}
    regions["+z"] = _at(top)
    return box((x, y, z + 0.5 * size_m[2]), size_m, regions)
