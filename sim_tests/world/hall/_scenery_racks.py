"""Meshes of pallet racks and their goods, one bay at a time.

A rack is closed along its middle, at both ends and on top. The camera therefore never sees through
a rack's box, which blocks every ray in the physics world too.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from ._layout import RackBox
from ._meshes import Mesh, SceneryChunk, box, merge, quad
from ._scenery_goods import Load, pallet_load
from ._textures import GOODS_ATLAS, GOODS_SETS

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

_region = GOODS_ATLAS.region


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
