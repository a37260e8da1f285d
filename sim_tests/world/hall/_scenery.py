"""The scenery of a hall as the camera sees it, in chunks, each with the name of its texture.

The building has a floor slab, walls with doors and signs, and a ceiling with beams and lamps. The
floor has markings (aisle lines, a zebra, storage places) and shade around things.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import FloatArray

from ..errors import SimError
from ._layout import WarehouseLayout
from ._meshes import (
    FIXTURE_ATLAS,
    GOODS_ATLAS,
    MARKING_ATLAS,
    TILE_M,
    WHOLE,
    Colour,
    Mesh,
    Region,
    SceneryChunk,
    box,
    merge,
    quad,
)
from ._scenery_goods import prop_chunk, rack_chunks

# Width and height of each wall fixture, and the height of its lower edge, metres.
_FIXTURES: Final[dict[str, tuple[float, float, float]]] = {
    "dock": (3.2, 3.4, 0.0),
    "dock_open": (3.2, 3.4, 0.0),
    "door": (1.1, 2.15, 0.0),
    "exit": (0.6, 0.3, 2.35),
    "extinguisher": (0.32, 0.96, 0.55),
    "cabinet": (0.8, 1.2, 0.6),
    "board": (1.6, 1.2, 1.0),
    "warning": (0.45, 0.45, 1.7),
    "duty": (0.45, 0.45, 1.7),
    "window": (3.0, 1.1, 4.2),
    "heater": (1.0, 0.7, 3.4),
    "clock": (0.5, 0.5, 3.0),
    "pipe": (0.1, 3.0, 0.0),
    **{f"number{k}": (0.7, 0.7, 3.5) for k in range(4)},
}
# Fixtures that hang together, and their distance to the right of the middle of a piece of wall.
_GROUPS: Final = (
    (("door", 0.0), ("exit", 0.0), ("extinguisher", 1.1)),
    (("board", 0.0), ("clock", 0.0)),
    (("cabinet", -0.8), ("warning", 0.1), ("pipe", -1.35)),
    (("extinguisher", -0.6), ("heater", 0.4)),
    (("duty", 0.0), ("pipe", 1.2)),
)
# Distance of a fixture's face from the wall.
_OFFSET_M: Final = 0.012
# Depth that is free of racks in front of a dock door.
_DOCK_DEPTH_M: Final = 2.0
_WHITE: Final[Colour] = (1.0, 1.0, 1.0)
_SIDES: Final = ("-x", "+x", "-y", "+y")

_Point = tuple[float, float, float]


def tiles(low: float, high: float) -> list[tuple[float, float]]:
    """Return the ends of the pieces of about :data:`TILE_M` that an extent is cut into."""
    count = max(1, round((high - low) / TILE_M))
    step = (high - low) / count
    return [(low + k * step, low + (k + 1) * step) for k in range(count)]


def hall_tones(variant: int) -> tuple[Colour, Colour]:
    """Return the tint of the floor with its markings, and the tint of the walls."""
    if variant == 0:
        return (0.98, 0.98, 0.98), (1.0, 1.0, 1.0)
    rng = np.random.default_rng((57, variant))
    floor, wall = rng.uniform(0.78, 1.0), rng.uniform(0.8, 1.0)
    tint = rng.uniform(-0.025, 0.025, (2, 3))
    colours = np.clip(np.array([[floor], [wall]]) + tint, 0.0, 1.0)
    return _colour(colours[0]), _colour(colours[1])


def _colour(rgb: FloatArray) -> Colour:
    red, green, blue = (float(value) for value in rgb)
    return red, green, blue


def floor_chunks(layout: WarehouseLayout, variant: int) -> Iterator[SceneryChunk]:
    """Yield one chunk per tile of the slab; turned textures keep the pattern from repeating."""
    floor, _ = hall_tones(variant)
    for i, (x0, x1) in enumerate(tiles(layout.x_min_m, layout.x_max_m)):
        for j, (y0, y1) in enumerate(tiles(layout.y_min_m, layout.y_max_m)):
            rng = np.random.default_rng((58, variant, i, j))
            corners = [(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)]
            turn, number = int(rng.integers(4)), int(rng.integers(2))
            mesh = quad(corners[turn:] + corners[:turn])
            tone = float(rng.uniform(0.97, 1.0))
            yield SceneryChunk(
                mesh, (tone * floor[0], tone * floor[1], tone * floor[2]), f"floor{number}"
            )


class _Wall(NamedTuple):
    """A wall as seen from inside: its lower left corner, its direction to the right, its length."""

    x_m: float
    y_m: float
    along_x: float
    along_y: float
    length_m: float

    def point(self, s: float, z: float, offset: float) -> _Point:
        """Return the point ``s`` from the left end, at height ``z``, ``offset`` from the wall."""
        return (
            self.x_m + self.along_x * s + self.along_y * offset,
            self.y_m + self.along_y * s - self.along_x * offset,
            z,
        )

    def rectangle(
        self, left: float, right: float, low: float, high: float, offset: float
    ) -> list[_Point]:
        """Return the corners of a rectangle, counter-clockwise from its lower left."""
        return [
            self.point(left, low, offset),
            self.point(right, low, offset),
            self.point(right, high, offset),
            self.point(left, high, offset),
        ]


def wall_chunks(layout: WarehouseLayout, variant: int) -> Iterator[SceneryChunk]:
    """Yield the pieces of the walls and the fixtures on them; walls are visible from inside."""
    _, tone = hall_tones(variant)
    height = layout.wall_height_m
    x_min, y_min, x_max, y_max = layout.x_min_m, layout.y_min_m, layout.x_max_m, layout.y_max_m
    walls = (
        _Wall(x_max, y_max, 0.0, -1.0, y_max - y_min),
        _Wall(x_min, y_min, 0.0, 1.0, y_max - y_min),
        _Wall(x_max, y_min, -1.0, 0.0, x_max - x_min),
        _Wall(x_min, y_max, 1.0, 0.0, x_max - x_min),
    )
    for number, wall in enumerate(walls):
        for k, (a, b) in enumerate(tiles(0.0, wall.length_m)):
            yield SceneryChunk(quad(wall.rectangle(a, b, 0.0, height, 0.0)), tone, "wall")
            rng = np.random.default_rng((59, variant, number, k))
            x, y, _ = wall.point(0.5 * (a + b), 0.0, 0.5 * _DOCK_DEPTH_M)
            fixtures = []
            for name, s in _fixtures(rng, b - a, k, _is_free(layout, x, y)):
                width, fixture_height, low = _FIXTURES[name]
                high = low + fixture_height
                if high <= height:
                    left = a + s - 0.5 * width
                    corners = wall.rectangle(left, left + width, low, high, _OFFSET_M)
                    fixtures.append(quad(corners, FIXTURE_ATLAS.region(name)))
            if fixtures:
                yield SceneryChunk(merge(fixtures), _WHITE, "fixtures")


def _is_free(layout: WarehouseLayout, x: float, y: float) -> bool:
    """Return whether no rack stands where a dock door centred on this point needs free floor."""
    half = 0.5 * _DOCK_DEPTH_M
    for rack in layout.racks:
        x_min, y_min, x_max, y_max = rack.box_odom_m
        if x_min - half < x < x_max + half and y_min - half < y < y_max + half:
            return False
    return True


def _fixtures(
    rng: np.random.Generator, width: float, k: int, free: bool
) -> Iterator[tuple[str, float]]:
    """Yield the names of the fixtures on a piece of wall, and their distance from its left end."""
    middle = 0.5 * width
    if free and width > 3.4 and rng.random() < 0.55:
        yield ("dock_open" if rng.random() < 0.3 else "dock"), middle + 0.1
        yield f"number{k % 4}", middle + 0.1
        return
    for name, right in _GROUPS[int(rng.integers(len(_GROUPS)))]:
        yield name, middle + right
    if rng.random() < 0.6:
        yield "window", middle + 0.1


def ceiling_chunks(layout: WarehouseLayout) -> Iterator[SceneryChunk]:
    """Yield the sheet, the beam and the lamp over each tile; they are visible from below only.

    A real ceiling is lit by the bright floor, but the renderers' light leaves every underside
    dark. Normals of the ceiling therefore point up, to catch the light that falls on the floor.
    """
    height = layout.wall_height_m
    for x0, x1 in tiles(layout.x_min_m, layout.x_max_m):
        for y0, y1 in tiles(layout.y_min_m, layout.y_max_m):
            sheet = _underside(x0, y0, x1, y1, height, WHOLE)
            yield SceneryChunk(_lit_from_above(sheet), (0.9, 0.9, 0.9), "ceiling")
            x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
            steel = GOODS_ATLAS.region("steel")
            beam = box(
                (x0 + 0.1, y, height - 0.2),
                (0.2, y1 - y0, 0.4),
                dict.fromkeys(("-x", "+x", "-z"), steel),
            )
            lamp = _underside(
                x - 0.75, y - 0.14, x + 0.75, y + 0.14, height - 0.25, GOODS_ATLAS.region("lamp")
            )
            tray = box((x, y, height - 0.2), (1.5, 0.28, 0.09), dict.fromkeys(_SIDES, steel))
            yield SceneryChunk(merge([beam, tray, _lit_from_above(lamp)]), _WHITE, "goods0")


def _underside(x0: float, y0: float, x1: float, y1: float, z: float, region: Region) -> Mesh:
    """Return a horizontal rectangle that is visible from below."""
    return quad([(x0, y0, z), (x0, y1, z), (x1, y1, z), (x1, y0, z)], region)


def _lit_from_above(mesh: Mesh) -> Mesh:
    """Return a downward-facing mesh with normals that point up."""
    return Mesh(mesh.vertices_m, -mesh.normals, mesh.indices, mesh.uv)


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
    """Return the parts of a line on the floor that are free of racks and props."""
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


@lru_cache(maxsize=8)  # many episodes use the same hall
def scenery(layout: WarehouseLayout, variant: int = 0) -> tuple[SceneryChunk, ...]:
    """Return the chunks that a hall is drawn from; the same arguments give the same bytes.

    Chunks that usually hide others come first, so a renderer with a depth buffer shades fewer
    pixels twice.
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
