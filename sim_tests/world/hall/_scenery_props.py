"""Meshes of the props; each part fills its collision box."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from importlib import resources
from typing import Final

import numpy as np

from ._meshes import Mesh, SceneryChunk, merge, read_meshes
from ._props import PROP_PARTS, Prop
from ._scenery_goods import PALLET_M, Load, goods_box, pallets, side_cell
from ._textures import GOODS_ATLAS, GOODS_SETS

_Maker = Callable[[np.random.Generator], Iterator[Mesh]]
_EURO_PALLET_M: Final = (1.2, 0.8)


def prop_chunk(prop: Prop, number: int, variant: int) -> SceneryChunk:
    """Return the prop in odom; ``number`` and ``variant`` choose tones and prints."""
    rng = np.random.default_rng((60, variant, number))
    cos, sin = prop.turn
    rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    maker = _LOADED.get(prop.kind)
    mesh = _shipped(prop.kind, rng) if maker is None else merge(maker(rng))
    tone = float(rng.uniform(0.92, 1.0))
    return SceneryChunk(
        mesh.transformed(rotation, (prop.x_m, prop.y_m, 0.0)),
        (tone, tone, tone),
        f"goods{variant % GOODS_SETS}",
    )


@cache
def _meshes() -> dict[str, Mesh]:
    """Return the meshes of all props without goods: ``forklift0``, ``bin0`` and so on."""
    return read_meshes((resources.files(__package__) / "props.npz").read_bytes())


def _shipped(kind: str, rng: np.random.Generator) -> Mesh:
    """Return a mesh of this kind of prop, by chance where it has several."""
    looks = [name for name in _meshes() if name.rstrip("0123456789") == kind]
    return _meshes()[looks[int(rng.integers(len(looks))) if len(looks) > 1 else 0]]


def _loaded_pallet(load: Load) -> _Maker:
    """Return the maker of a pallet with goods up to the top of its collision box."""
    total = PROP_PARTS[f"pallet_{load if load != 'cartons' else 'goods'}"][0].height_m
    free = total - PALLET_M
    tops: dict[Load, str] = {"cartons": "top0", "drums": "dark"}

    def make(rng: np.random.Generator) -> Iterator[Mesh]:
        yield from pallets(1, (0.0, 0.0, 0.0), _EURO_PALLET_M)
        height = free * float(rng.uniform(0.62, 0.8)) if load == "cartons" else free
        side, top = side_cell(load, rng), tops.get(load, "wrap_top")
        yield goods_box((0.0, 0.0, PALLET_M), (1.17, 0.77, height), side, top)
        if load == "cartons":  # the last layer: two stacks of other cartons
            for x, length in ((-0.3, 0.56), (0.3, 0.58)):
                upper = (free - height) * float(rng.uniform(0.85, 1.0))
                carton = GOODS_ATLAS.drawn("carton", rng)
                size = (length, 0.76, upper)
                yield goods_box((x, 0.0, PALLET_M + height), size, carton, "top1")

    return make


def _empty_pallets(count: int) -> _Maker:
    def make(_: np.random.Generator) -> Iterator[Mesh]:
        yield from pallets(count, (0.0, 0.0, 0.0), _EURO_PALLET_M)

    return make


_LOADED: Final[dict[str, _Maker]] = {
    "pallet": _empty_pallets(1),
    "pallet_stack": _empty_pallets(7),
    "pallet_goods": _loaded_pallet("cartons"),
    "pallet_wrapped": _loaded_pallet("wrapped"),
    "pallet_sacks": _loaded_pallet("sacks"),
    "pallet_drums": _loaded_pallet("drums"),
}
