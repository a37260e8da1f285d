"""Meshes of the props that carry no goods."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from sim_tests.world.hall import Mesh, Region, box, merge

from ._goods import GOODS_ATLAS
from ._round_meshes import tube

_SIDES: Final = ("-x", "+x", "-y", "+y")
_FACES: Final = {
    "front": "+x",
    "back": "-x",
    "left": "+y",
    "right": "-y",
    "top": "+z",
    "under": "-z",
}
_region = GOODS_ATLAS.region


def prop_meshes() -> dict[str, Mesh]:
    """Return the mesh of every look of every kind of prop: ``forklift0``, ``bin0``, and so on."""
    looks = {
        "pallet_truck": [_pallet_truck()],
        "stacker": [_stacker()],
        "forklift": [_forklift()],
        "roller_container": [_roller_container(cage) for cage in range(2)],
        "shelf": [_shelf()],
        "crates": [_crates(stack) for stack in range(5)],
        "bin": [_bin(colour) for colour in ("green", "blue", "dark", "grey")],
        "barrier": [_barrier()],
        "post": [_post()],
    }
    return {
        f"{kind}{number}": merge(parts)
        for kind, each in looks.items()
        for number, parts in enumerate(each)
    }


def _solid(
    center: tuple[float, float, float], size: tuple[float, float, float], side: str, top: str = ""
) -> Mesh:
    """Return a box with one atlas cell on its sides and another on top (none: the same)."""
    regions: dict[str, Region] = dict.fromkeys(_SIDES, _region(side))
    return box(center, size, {**regions, "+z": _region(top or side)})


def _faces(
    center: tuple[float, float, float], size: tuple[float, float, float], **names: str
) -> Mesh:
    """Return a box with the atlas cells given by face (``front``, ``back``, ``left``, …) only."""
    return box(center, size, {_FACES[key]: _region(name) for key, name in names.items()})


def _around(name: str) -> dict[str, str]:
    """Return arguments of :func:`_faces` for one cell on all four sides."""
    return dict.fromkeys(("front", "back", "left", "right"), name)


def _pallet_truck() -> Iterator[Mesh]:
    for y in (-0.19, 0.19):
        yield _solid((-0.2, y, 0.12), (1.15, 0.16, 0.10), "red")
        yield _solid((-0.7, y, 0.045), (0.1, 0.1, 0.09), "rubber")
    yield _solid((0.33, 0.0, 0.12), (0.1, 0.5, 0.14), "red")
    yield _solid((0.48, 0.0, 0.34), (0.2, 0.38, 0.36), "red", "dark")
    yield _solid((0.49, 0.0, 0.09), (0.18, 0.34, 0.18), "rubber")
    yield _solid((0.64, 0.0, 0.55), (0.1, 0.1, 1.08), "dark")
    yield _solid((0.64, 0.0, 1.13), (0.08, 0.15, 0.17), "red", "dark")


def _stacker() -> Iterator[Mesh]:
    for y in (-0.19, 0.19):
        yield _solid((-0.55, y, 0.07), (1.1, 0.18, 0.08), "dark")
    yield _faces((0.1, 0.0, 1.02), (0.18, 0.76, 1.96), **_around("mast"), top="dark")
    yield _faces(
        (0.5, 0.0, 0.6),
        (0.58, 0.76, 1.06),
        front="yellow",
        left="yellow",
        right="yellow",
        top="dark",
    )
    yield _faces((0.79, 0.0, 0.42), (0.012, 0.5, 0.3), front="grille")
    yield _faces((0.5, 0.0, 0.12), (0.6, 0.77, 0.2), **_around("dark"))
    yield _faces((0.66, 0.0, 1.12), (0.2, 0.3, 0.05), **_around("dark"), top="dark")


def _forklift() -> Iterator[Mesh]:
    for y in (-0.3, 0.3):
        yield _solid((1.35, y, 0.08), (1.0, 0.14, 0.05), "dark")
    yield _faces((0.74, 0.0, 1.1), (0.2, 0.94, 2.1), **_around("mast"), top="dark")
    yield _faces((0.86, 0.0, 0.35), (0.03, 0.9, 0.5), **_around("dark"), top="dark")
    yield _faces((-0.06, 0.0, 0.62), (1.36, 1.04, 0.9), **_around("orange"), top="dark")
    yield _faces((-0.06, 0.0, 1.54), (1.32, 0.98, 0.96), **_around("window"))
    for x in (-0.7, 0.58):  # pillars of the cab
        for y in (-0.49, 0.49):
            yield _solid((x, y, 1.54), (0.08, 0.08, 0.98), "dark")
    yield _solid((-0.06, 0.0, 2.06), (1.38, 1.06, 0.08), "dark")
    yield _faces((-1.0, 0.0, 0.62), (0.5, 1.04, 0.84), **_around("orange"), top="dark")
    yield _faces((-1.255, 0.0, 0.5), (0.012, 0.8, 0.3), back="hazard")
    for x, radius in ((0.34, 0.3), (-0.9, 0.24)):
        for side in (-1.0, 1.0):
            wheel = tube(
                [(0, 0, 0.09, radius, radius), (0, 0, -0.09, radius, radius)], 12, _region("rubber")
            )
            turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
            yield wheel.transformed(turn, (x, side * 0.45, radius))
    yield _faces((-0.06, 0.0, 0.1), (1.3, 0.9, 0.18), **_around("dark"))
    yield _faces((-0.95, 0.0, 0.12), (0.4, 0.9, 0.2), **_around("dark"))


def _roller_container(cage: int) -> Iterator[Mesh]:
    yield _solid((0.0, 0.0, 0.92), (0.79, 0.69, 1.54), f"cage{cage}", "top2")
    yield _solid((0.0, 0.0, 0.14), (0.8, 0.7, 0.04), "steel")
    for x in (-0.33, 0.33):
        for y in (-0.28, 0.28):
            yield _solid((x, y, 0.06), (0.12, 0.05, 0.12), "rubber")


def _shelf() -> Iterator[Mesh]:
    yield _faces(
        (0.0, 0.0, 1.0),
        (1.19, 0.44, 2.0),
        left="parts",
        right="parts",
        front="steel",
        back="steel",
        top="steel",
    )


def _crates(stack: int) -> Iterator[Mesh]:
    yield _solid((0.0, 0.0, 0.625), (0.59, 0.39, 1.25), f"crates{stack}", "crates_top")


def _bin(colour: str) -> Iterator[Mesh]:
    body = tube(
        [(0, 0, 0.95, 0.41, 0.37), (0, 0, 0.1, 0.33, 0.31)], 4, _region(colour), _region("dark")
    )
    half = math.sqrt(0.5)
    eighth = np.array([[half, -half, 0.0], [half, half, 0.0], [0.0, 0.0, 1.0]])
    yield body.transformed(eighth)
    yield _solid((0.0, 0.0, 1.0), (0.6, 0.55, 0.11), colour)
    for y in (-0.22, 0.22):
        yield _solid((-0.22, y, 0.1), (0.2, 0.06, 0.2), "rubber")


def _barrier() -> Iterator[Mesh]:
    yield _faces((0.0, 0.0, 0.25), (2.0, 0.08, 0.3), **{**_around("yellow"), "top": "yellow"})
    yield _faces((0.0, 0.0, 0.25), (1.99, 0.086, 0.1), left="hazard", right="hazard")
    for x in (-0.94, 0.0, 0.94):
        yield _solid((x, 0.0, 0.21), (0.11, 0.11, 0.42), "dark", "yellow")


def _post() -> Iterator[Mesh]:
    yield tube(
        [(0, 0, 1.0, 0.07, 0.07), (0, 0, 0.05, 0.075, 0.075)],
        8,
        _region("hazard"),
        _region("yellow"),
    )
    yield _solid((0.0, 0.0, 0.025), (0.16, 0.16, 0.05), "dark")
