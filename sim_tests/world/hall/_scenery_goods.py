"""Meshes of what stands in a hall: pallets and their loads, props, and racks, one bay at a time.

A rack is closed along its middle, at both ends and on top. The camera therefore never sees through
a rack's box, which blocks every ray in the physics world too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from importlib import resources
from typing import Final, Literal

import numpy as np

from ._layout import PROP_PARTS, Prop, RackBox
from ._meshes import GOODS_ATLAS, GOODS_SETS, Mesh, SceneryChunk, box, merge, quad, read_meshes

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
    """Yield the meshes of a pallet and its load."""
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


_POST_M: Final = 0.10
_BEAM_M: Final = 0.12
# Free height above the goods, for the forks.
_HEADROOM_M: Final = 0.16
_QUARTER_TURN: Final = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_LABEL_CORNERS: Final = ((1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0))
# The probability of each load of a storage place.
_LOAD_PROBABILITIES: Final[dict[Load, float]] = {
    "cartons": 0.34,
    "heaps": 0.16,
    "wrapped": 0.17,
    "crates": 0.12,
    "sacks": 0.06,
    "drums": 0.06,
    "pallets": 0.05,
    "nothing": 0.04,
}


def rack_chunks(rack: RackBox, number: int, variant: int) -> Iterator[SceneryChunk]:
    """Yield one chunk per bay in odom; ``number`` and ``variant`` choose the goods."""
    along_x = rack.length_m >= rack.width_m
    length, depth = (rack.length_m, rack.width_m) if along_x else (rack.width_m, rack.length_m)
    bays = max(1, round(length / 2.6))
    for bay in range(bays):
        rng = np.random.default_rng((variant, number, bay))
        low, high = (bay / bays - 0.5) * length, ((bay + 1) / bays - 0.5) * length
        pieces = [
            *_frame(low, high, depth, rack.height_m),
            *_ends(bay == 0, bay == bays - 1, low, high, depth, rack.height_m, number),
            *_goods(low, high, depth, rack.height_m, rng),
        ]
        mesh = merge(pieces).transformed(
            None if along_x else _QUARTER_TURN, (rack.x_m, rack.y_m, 0.0)
        )
        tone = float(rng.uniform(0.9, 1.0))
        yield SceneryChunk(mesh, (tone, tone, tone), f"goods{variant % GOODS_SETS}")


def _levels(height: float) -> list[float]:
    """Return the heights that goods stand on."""
    levels = max(1, round(height / 1.35))
    return [k * height / levels for k in range(levels)]


def _frame(low: float, high: float, depth: float, height: float) -> Iterator[Mesh]:
    """Yield the posts, beams, labels, decks and middle wall of a bay from ``low`` to ``high``.

    Neighbouring bays have one half each of the posts between them.
    """
    half, middle = 0.5 * depth, 0.5 * (low + high)
    dark, length = _region("backing"), high - low
    for side in (1.0, -1.0):
        left, right = (middle + end * side * 0.5 * length for end in (1.0, -1.0))
        wall = 0.01 * side
        yield quad(
            [(left, wall, 0.0), (right, wall, 0.0), (right, wall, height), (left, wall, height)],
            dark,
        )
        outward = "+y" if side > 0 else "-y"
        for s, inward in ((low, "+x"), (high, "-x")):
            yield box(
                (
                    s + (0.25 if s == low else -0.25) * _POST_M,
                    side * (half - 0.5 * _POST_M),
                    height / 2,
                ),
                (0.5 * _POST_M, _POST_M, height),
                {outward: _region("upright"), inward: _region("upright")},
            )
        for level in (*_levels(height)[1:], height):
            yield box(
                (middle, side * (half - 0.04), level - 0.5 * _BEAM_M),
                (length - _POST_M, 0.06, _BEAM_M),
                {outward: _region("beam"), "-z": _region("orange")},
            )
        # Labels are separate faces: PyBullet's software renderer distorts the texture of a long
        # face that reaches behind the camera.
        for level in _levels(height)[1:]:
            for share in (-0.25, 0.25):
                s, y, z = middle + share * length, side * (half - 0.006), level - 0.5 * _BEAM_M
                plate = [(s + side * u * 0.08, y, z + v * 0.035) for u, v in _LABEL_CORNERS]
                yield quad(plate, _region("label"))
    for level in (*_levels(height)[1:], height):
        yield box(
            (middle, 0.0, level - 0.015),
            (length, depth - 0.1 if level < height else depth, 0.03),
            {"+z": _region("deck"), "-z": _region("deck")},
        )


def _ends(
    first: bool, last: bool, low: float, high: float, depth: float, height: float, number: int
) -> Iterator[Mesh]:
    """Yield the sheets that close the ends of the rack, each with the rack's sign."""
    half = 0.5 * depth
    for s, out, present in ((low, -1.0, first), (high, 1.0, last)):
        if not present:
            continue
        corners = [(s, -half * out, 0.0), (s, half * out, 0.0)]
        sheet = [*corners, (s, half * out, height), (s, -half * out, height)]
        yield quad(sheet, _region("end"))
        # Inner side of the sheet, visible past the goods.
        yield quad([(x - 0.005 * out, -y, z) for x, y, z in sheet], _region("ladder"))
        sign = _region(f"sign{number % GOODS_ATLAS.count('sign')}")
        y, z = 0.36 * half * out, min(2.1, 0.75 * height)
        plate = [(-1, -0.5), (1, -0.5), (1, 0.5), (-1, 0.5)]
        yield quad([(s + 0.01 * out, u * y, z + v * 0.36 * half) for u, v in plate], sign)


def _goods(
    low: float, high: float, depth: float, height: float, rng: np.random.Generator
) -> Iterator[Mesh]:
    """Yield the pallets on every level of a bay, two or three on each in a usual one."""
    levels = _levels(height)
    max_height = (levels[1] if len(levels) > 1 else height) - _BEAM_M - _HEADROOM_M
    inner = high - low - _POST_M
    for level in levels:
        places = 3 if inner > 2.4 and rng.random() < 0.6 else max(1, round(inner / 1.25))
        pitch = inner / places
        probabilities = tuple(_LOAD_PROBABILITIES.values())
        kinds = rng.choice(len(probabilities), size=places, p=probabilities)
        for place, kind in enumerate(kinds.tolist()):
            s = low + 0.5 * _POST_M + (place + 0.5) * pitch + float(rng.uniform(-0.02, 0.02))
            size = (min(pitch - 0.06, 1.2), depth - 0.16)
            load = tuple(_LOAD_PROBABILITIES)[kind]
            yield from pallet_load(load, (s, 0.0, level), size, max_height, rng)
