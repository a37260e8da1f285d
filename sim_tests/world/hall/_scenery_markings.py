"""Meshes of the floor markings: aisle lines, a zebra, storage places, and shade around things."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from perception.arrays import FloatArray

from ._layout import WarehouseLayout
from ._meshes import Mesh, SceneryChunk, merge, quad
from ._scenery_hall import hall_tones, tiles
from ._textures import MARKING_ATLAS, TILE_M

# Heights above the slab: enough for the depth buffer, too little to see. Lines lie over shades.
_SHADE_Z_M: Final = 0.002
_PAINT_Z_M: Final = 0.004
_LINE_WIDTH_M: Final = 0.08
# Extent of the soft shade around a rack and around a prop.
_RACK_SHADE_M: Final = 0.40
_PROP_SHADE_M: Final = 0.22
# Distance of a storage place's frame from the pallet, and of aisle lines from the walls.
_PLACE_MARGIN_M: Final = 0.25
_FROM_WALL_M: Final = 1.5


def marking_chunks(layout: WarehouseLayout, variant: int) -> Iterator[SceneryChunk]:
    """Yield all markings, one chunk per tile of the floor."""
    floor, _ = hall_tones(variant)
    pieces: dict[tuple[int, int], list[Mesh]] = {}
    columns, rows = tiles(layout.x_min_m, layout.x_max_m), tiles(layout.y_min_m, layout.y_max_m)
    for mesh in (*_shades(layout), *_lines(layout), *_zebra(layout), *_places(layout)):
        x, y, _ = mesh.vertices_m.mean(axis=0).tolist()
        cell = (
            min(int((x - layout.x_min_m) / (columns[0][1] - columns[0][0])), len(columns) - 1),
            min(int((y - layout.y_min_m) / (rows[0][1] - rows[0][0])), len(rows) - 1),
        )
        pieces.setdefault(cell, []).append(mesh)
    for meshes in pieces.values():
        yield SceneryChunk(merge(meshes), floor, "paint")


def free_spans(
    layout: WarehouseLayout, low: float, high: float, across: float, *, along_x: bool
) -> list[tuple[float, float]]:
    """Return the parts of a line on the floor that are free of racks and props.

    Args:
        layout: the hall.
        low: start of the line along its axis, metres.
        high: its end.
        across: its coordinate on the other axis.
        along_x: whether it runs along odom x.
    """
    props = [box for prop in layout.props for box in prop.boxes_odom_m]
    occupied = []
    for x_min, y_min, x_max, y_max in (*(rack.box_odom_m for rack in layout.racks), *props):
        start, end, near, far = (
            (x_min, x_max, y_min, y_max) if along_x else (y_min, y_max, x_min, x_max)
        )
        if near - 0.5 * _LINE_WIDTH_M < across < far + 0.5 * _LINE_WIDTH_M:
            occupied.append((start, end))
    spans, at = [], low
    for start, end in (*sorted(occupied), (high, high)):
        if min(start, high) - at > 0.1:
            spans.append((at, min(start, high)))
        at = max(at, end)
    return spans


def _flat(x0: float, y0: float, x1: float, y1: float, z: float) -> list[tuple[float, float, float]]:
    """Return the corners of a horizontal rectangle that is visible from above."""
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


def _line(
    layout: WarehouseLayout, low: float, high: float, across: float, along_x: bool
) -> Iterator[Mesh]:
    """Yield a painted line from ``low`` to ``high``, where the floor is free."""
    half = 0.5 * _LINE_WIDTH_M
    for start, end in free_spans(layout, low, high, across, along_x=along_x):
        count = math.ceil((end - start) / TILE_M)
        for k in range(count):
            a, b = (start + (end - start) * share for share in (k / count, (k + 1) / count))
            region = MARKING_ATLAS.region("line", (0.0, 0.0, min((b - a) / TILE_M, 1.0), 1.0))
            if along_x:
                yield quad(_flat(a, across - half, b, across + half, _PAINT_Z_M), region)
            else:
                corners = _flat(across - half, a, across + half, b, _PAINT_Z_M)
                yield quad(corners[1:] + corners[:1], region)


def _lines(layout: WarehouseLayout) -> Iterator[Mesh]:
    """Yield the edge lines of the robot's aisle, of the cross aisle, and along racks elsewhere."""
    half = 0.5 * layout.aisle_width_m - _LINE_WIDTH_M
    x_low, x_high = layout.x_min_m + _FROM_WALL_M, layout.x_max_m - _FROM_WALL_M
    crossing = layout.cross_aisle_x_m
    for side in (1.0, -1.0):
        if crossing is None or not _has_branch(layout, side):
            yield from _line(layout, x_low, x_high, side * half, True)
            continue
        cross = 0.5 * layout.cross_aisle_width_m - _LINE_WIDTH_M
        yield from _line(layout, x_low, crossing - cross, side * half, True)
        yield from _line(layout, crossing + cross, x_high, side * half, True)
        edge = layout.y_max_m if side > 0.0 else layout.y_min_m
        low, high = sorted((side * half, edge - side * _FROM_WALL_M))
        for x in (crossing - cross, crossing + cross):
            yield from _line(layout, low, high, x, False)
    aisle = 0.5 * layout.aisle_width_m + 0.3
    for rack in layout.racks:
        x_min, y_min, x_max, y_max = rack.box_odom_m
        if rack.length_m < rack.width_m:
            continue
        for y in (y_min - 0.1, y_max + 0.1):
            if abs(y) > aisle and layout.y_min_m + 0.5 < y < layout.y_max_m - 0.5:
                yield from _line(layout, x_min, x_max, y, True)


def _has_branch(layout: WarehouseLayout, side: float) -> bool:
    """Return whether the cross aisle leaves the robot's aisle on this side."""
    if layout.cross_aisle_x_m is None:
        return False
    edge = side * 0.5 * layout.aisle_width_m
    low, high = sorted((edge, edge + side * 2.0))
    spans = free_spans(layout, low, high, layout.cross_aisle_x_m, along_x=False)
    return sum(end - start for start, end in spans) > 1.9


def _zebra(layout: WarehouseLayout) -> Iterator[Mesh]:
    """Yield the bars of the zebra where people cross the robot's aisle along y."""
    if layout.cross_aisle_x_m is None or not all(_has_branch(layout, side) for side in (1.0, -1.0)):
        return
    half, bars = 0.5 * layout.aisle_width_m - _LINE_WIDTH_M, 6
    pitch = (layout.cross_aisle_width_m - 0.36) / bars
    for k in range(bars):
        x = layout.cross_aisle_x_m + (k - 0.5 * (bars - 1)) * pitch
        yield quad(
            _flat(x - 0.25 * pitch, -half, x + 0.25 * pitch, half, _PAINT_Z_M),
            MARKING_ATLAS.region("zebra"),
        )


def _places(layout: WarehouseLayout) -> Iterator[Mesh]:
    """Yield a painted frame around every pallet that stands on the floor."""
    for prop in layout.props:
        if prop.kind.startswith("pallet_") and prop.kind != "pallet_truck":
            outer = _grown(prop.corners_odom_m[0], _PLACE_MARGIN_M)
            if all(_is_inside(layout, x, y) for x, y in outer.tolist()):
                corners = [(x, y, 0.5 * _SHADE_Z_M) for x, y in outer.tolist()]
                yield quad(corners, MARKING_ATLAS.region("place"))


def _shades(layout: WarehouseLayout) -> Iterator[Mesh]:
    """Yield the dark floor under racks and props, and the soft shade around them."""
    for rack in layout.racks:
        x_min, y_min, x_max, y_max = rack.box_odom_m
        for x0, x1 in tiles(x_min, x_max):
            for y0, y1 in tiles(y_min, y_max):
                yield quad(_flat(x0, y0, x1, y1, _SHADE_Z_M), MARKING_ATLAS.region("under"))
        corners = np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])
        yield from _shade_around(layout, corners, _RACK_SHADE_M)
    for prop in layout.props:
        for corners, height in zip(prop.corners_odom_m, prop.heights_m, strict=True):
            under = [(x, y, _SHADE_Z_M) for x, y in corners.tolist()]
            yield quad(under, MARKING_ATLAS.region("under"))
            yield from _shade_around(layout, corners, min(_PROP_SHADE_M, 0.5 * height))


def _grown(corners_m: FloatArray, margin_m: float) -> FloatArray:
    """Return a rectangle (4, 2), counter-clockwise, with all sides moved outwards."""
    along = np.roll(corners_m, -1, axis=0) - corners_m
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(corners_m + margin_m * (np.roll(along, 1, axis=0) - along))


def _shade_around(layout: WarehouseLayout, corners_m: FloatArray, reach: float) -> Iterator[Mesh]:
    """Yield mitred strips, dark at the footprint and as light as the slab at ``reach`` from it."""
    outer_m = _grown(corners_m, reach)
    region = MARKING_ATLAS.region("shade")
    for k in range(4):
        n = (k + 1) % 4
        if not all(_is_inside(layout, *outer_m[i].tolist()) for i in (k, n)):
            continue
        pieces = max(1, round(float(np.linalg.norm(corners_m[n] - corners_m[k])) / TILE_M))
        inner = np.linspace(corners_m[k], corners_m[n], pieces + 1)
        outer = np.linspace(outer_m[k], outer_m[n], pieces + 1)
        for piece in range(pieces):
            rim = np.stack([outer[piece], outer[piece + 1], inner[piece + 1], inner[piece]])
            yield quad([(x, y, _SHADE_Z_M) for x, y in rim.tolist()], region)


def _is_inside(layout: WarehouseLayout, x: float, y: float) -> bool:
    return layout.x_min_m <= x <= layout.x_max_m and layout.y_min_m <= y <= layout.y_max_m
