"""Meshes of pallets and their loads: cartons, wrapped goods, crates, sacks and drums."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, Literal

import numpy as np

from ._meshes import Mesh, box
from ._textures import GOODS_ATLAS

#: The load of a pallet: ``"cartons"`` are of one kind, ``"heaps"`` are two stacks of different
#: cartons, ``"pallets"`` is a stack of empty pallets, and ``"nothing"`` has not even a pallet.
Load = Literal["cartons", "heaps", "wrapped", "crates", "sacks", "drums", "pallets", "nothing"]

#: Height of a euro pallet with a narrow gap above it.
PALLET_M: Final = 0.148
_WOOD_M: Final = 0.144
_MAX_STACK_M: Final = 1.06
_MAX_DRUM_M: Final = 0.9
# Cells of the goods atlas for the tops of loads, and the kinds of cells for their sides.
_TOPS: Final = {"wrapped": "wrap_top", "crates": "crates_top", "sacks": "wrap_top", "drums": "dark"}
_SIDES_OF: Final[dict[str, str]] = {
    "cartons": "stack",
    "heaps": "stack",
    "wrapped": "wrap",
    "crates": "crates",
    "sacks": "sacks",
    "drums": "drums",
}
# The least share of the free height that a load fills.
_MIN_FILL: Final = {"wrapped": 0.8, "crates": 0.6, "sacks": 0.45, "drums": 0.8}
_SIDES: Final = ("-x", "+x", "-y", "+y")

_region = GOODS_ATLAS.region


def pallet_load(
    load: Load,
    foot_m: tuple[float, float, float],
    size_m: tuple[float, float],
    max_height_m: float,
    rng: np.random.Generator,
) -> Iterator[Mesh]:
    """Yield the meshes of a pallet and its load.

    Args:
        load: the load.
        foot_m: the middle of the pallet's underside.
        size_m: extents of the pallet along x and y.
        max_height_m: greatest height of pallet and goods together.
        rng: draws heights and prints.
    """
    if load == "nothing":
        return
    x, y, z = foot_m
    if load == "pallets":
        count = max(1, math.floor(min(max_height_m, _MAX_STACK_M) / PALLET_M))
        yield from pallets(count, foot_m, size_m)
        return
    yield from pallets(1, foot_m, size_m)
    base, free = z + PALLET_M, max(max_height_m - PALLET_M, 0.1)
    width, depth = size_m[0] - 0.04, size_m[1] - 0.04
    if load == "cartons":
        height = free * float(rng.uniform(0.55, 1.0))
        side = GOODS_ATLAS.drawn("stack", rng)
        size = (width, depth, height)
        yield goods_box((x, y, base), size, side, f"top{int(side[5:]) % 4}")
        if height < 0.72 * free:  # one more carton on top
            edge = min(0.42, free - height, 0.5 * width)
            aside = float(rng.choice((-1.0, 1.0))) * (0.5 * (width - edge) - 0.02)
            carton = GOODS_ATLAS.drawn("carton", rng)
            size = (edge, 0.86 * depth, edge * float(rng.uniform(0.7, 1.0)))
            yield goods_box((x + aside, y, base + height), size, carton, "top0")
    elif load == "heaps":
        split = float(rng.uniform(0.42, 0.58))
        for share, middle in ((split, 0.5 * (split - 1.0)), (1.0 - split, 0.5 * split)):
            height = free * float(rng.uniform(0.45, 0.95))
            side = GOODS_ATLAS.drawn("stack" if height >= 0.7 else "carton", rng)
            size = (share * width - 0.015, depth, height)
            yield goods_box((x + middle * width, y, base), size, side, "top1")
    else:
        height = free * float(rng.uniform(_MIN_FILL[load], 1.0))
        if load == "drums":
            height = min(height, _MAX_DRUM_M)
        yield goods_box((x, y, base), (width, depth, height), side_cell(load, rng), _TOPS[load])


def side_cell(load: Load, rng: np.random.Generator) -> str:
    """Return the name of an atlas cell that shows a load from the side."""
    return GOODS_ATLAS.drawn(_SIDES_OF[load], rng)


def pallets(
    count: int, foot_m: tuple[float, float, float], size_m: tuple[float, float]
) -> Iterator[Mesh]:
    """Yield empty pallets on top of each other."""
    x, y, z = foot_m
    for k in range(count):
        regions = {name: _region("pallet_side") for name in _SIDES}
        if k == count - 1:
            regions["+z"] = _region("pallet_top")
        yield box((x, y, z + (k + 0.5) * PALLET_M), (*size_m, _WOOD_M), regions)


def goods_box(
    foot_m: tuple[float, float, float], size_m: tuple[float, float, float], side: str, top: str
) -> Mesh:
    """Return a box that stands on ``foot_m``, with one atlas cell on its sides and one on top."""
    x, y, z = foot_m
    regions = {name: _region(side) for name in _SIDES}
    regions["+z"] = _region(top)
    return box((x, y, z + 0.5 * size_m[2]), size_m, regions)
