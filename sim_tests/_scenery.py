"""What the camera sees of a warehouse: one mesh a colour, so that a hall is a dozen bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Final

from ._layout import RackBox, WarehouseLayout
from ._meshes import Mesh, box, merge, quad

Colour = tuple[float, float, float]

_FLOOR: Final[Colour] = (0.60, 0.61, 0.60)
_FLOOR_AISLE: Final[Colour] = (0.54, 0.56, 0.57)
_WALL: Final[Colour] = (0.74, 0.76, 0.77)
_WALL_BASE: Final[Colour] = (0.50, 0.56, 0.60)
_COLUMN: Final[Colour] = (0.56, 0.58, 0.60)
_LINE: Final[Colour] = (0.93, 0.76, 0.18)
_ZEBRA: Final[Colour] = (0.90, 0.90, 0.87)
_UPRIGHT: Final[Colour] = (0.18, 0.31, 0.52)
_BEAM: Final[Colour] = (0.82, 0.42, 0.14)
_PALLET: Final[Colour] = (0.62, 0.49, 0.33)
_CEILING: Final[Colour] = (0.84, 0.86, 0.88)
_LAMP: Final[Colour] = (1.0, 1.0, 1.0)
_DECK: Final[Colour] = (0.55, 0.56, 0.57)
_BACKING: Final[Colour] = (0.36, 0.38, 0.40)
_CARTONS: Final[tuple[Colour, ...]] = (
    (0.69, 0.55, 0.38),
    (0.60, 0.46, 0.31),
    (0.75, 0.64, 0.48),
    (0.45, 0.53, 0.55),
)

# Paint lies this far above the floor: enough for the depth buffer, too little to see.
_PAINT_M: Final = 0.004
# Pieces of floor no larger than this keep the shading even and the near-plane clipping small.
_TILE_M: Final = 4.0


@lru_cache(maxsize=8)  # many episodes play in the same hall
def scenery(layout: WarehouseLayout) -> tuple[tuple[Colour, Mesh], ...]:
    """Meshes in odom with their colours: floor, walls, paint, racks and the goods in them."""
    pieces: dict[Colour, list[Mesh]] = {}
    for colour, mesh in (*_hall(layout), *_paint(layout)):
        pieces.setdefault(colour, []).append(mesh)
    for number, rack in enumerate(layout.racks):
        for colour, mesh in _rack(rack, number):
            pieces.setdefault(colour, []).append(mesh)
    return tuple((colour, merge(meshes)) for colour, meshes in pieces.items())


def _flat(x_min: float, y_min: float, x_max: float, y_max: float, z: float) -> Mesh:
    return quad([(x_min, y_min, z), (x_max, y_min, z), (x_max, y_max, z), (x_min, y_max, z)])


def _overhead(x_min: float, y_min: float, x_max: float, y_max: float, z: float) -> Mesh:
    return quad([(x_min, y_min, z), (x_min, y_max, z), (x_max, y_max, z), (x_max, y_min, z)])


def _hall(layout: WarehouseLayout) -> Iterator[tuple[Colour, Mesh]]:
    x_min, y_min = layout.x_min_m, layout.y_min_m
    x_max, y_max = layout.x_max_m, layout.y_max_m
    columns = math.ceil((x_max - x_min) / _TILE_M)
    rows = math.ceil((y_max - y_min) / _TILE_M)
    step_x, step_y = (x_max - x_min) / columns, (y_max - y_min) / rows
    for i in range(columns):
        for j in range(rows):
            x, y = x_min + i * step_x, y_min + j * step_y
            yield _FLOOR, _flat(x, y, x + step_x, y + step_y, 0.0)
    # Walls face inwards only, so that a view from outside looks into the hall.
    corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        pieces = math.ceil(math.hypot(bx - ax, by - ay) / _TILE_M)
        for k in range(pieces):
            s, t = k / pieces, (k + 1) / pieces
            a = (ax + (bx - ax) * s, ay + (by - ay) * s)
            b = (ax + (bx - ax) * t, ay + (by - ay) * t)
            for colour, low, high in (
                (_WALL_BASE, 0.0, 1.0),
                (_WALL, 1.0, layout.wall_height_m),
            ):
                yield colour, quad([(*b, low), (*a, low), (*a, high), (*b, high)])
            if k:
                yield (
                    _COLUMN,
                    box((*a, 0.5 * layout.wall_height_m), (0.3, 0.3, layout.wall_height_m)),
                )
    # The ceiling faces down only, so that a view from above looks into the hall as well.
    for i in range(columns):
        for j in range(rows):
            x, y = x_min + i * step_x, y_min + j * step_y
            yield _CEILING, _overhead(x, y, x + step_x, y + step_y, layout.wall_height_m)
            x, y = x + 0.5 * step_x, y + 0.5 * step_y
            yield _LAMP, _overhead(x - 0.8, y - 0.1, x + 0.8, y + 0.1, layout.wall_height_m - 0.05)


def _paint(layout: WarehouseLayout) -> Iterator[tuple[Colour, Mesh]]:
    half, line = 0.5 * layout.aisle_width_m - 0.08, 0.08
    x_low, x_high = layout.x_min_m + 1.5, layout.x_max_m - 1.5
    crossing = layout.cross_aisle_x_m
    gaps = [(x_low, x_high)]
    if crossing is not None:
        cross = 0.5 * layout.cross_aisle_width_m - 0.08
        gaps = [(x_low, crossing - cross), (crossing + cross, x_high)]
        for side in (1.0, -1.0):
            for x in (crossing - cross, crossing + cross):
                y_low, y_high = sorted((side * half, side * (layout.y_max_m - 1.5)))
                yield _LINE, _flat(x - line / 2, y_low, x + line / 2, y_high, _PAINT_M)
        stripes = 6
        for k in range(stripes):  # a zebra for people who cross the robot's aisle along y
            x = crossing + (k - 0.5 * (stripes - 1)) * 0.44
            yield _ZEBRA, _flat(x - 0.11, -half, x + 0.11, half, _PAINT_M)
    for low, high in gaps:
        yield _FLOOR_AISLE, _flat(low, -half, high, half, 0.5 * _PAINT_M)
        for y in (-half, half):
            yield _LINE, _flat(low, y - line / 2, high, y + line / 2, _PAINT_M)


def _rack(rack: RackBox, number: int) -> Iterator[tuple[Colour, Mesh]]:
    """Uprights, beams, a closed middle, pallets and cartons inside the rack's box."""
    along_x = rack.length_m >= rack.width_m
    length, depth = (rack.length_m, rack.width_m) if along_x else (rack.width_m, rack.length_m)
    bays = max(1, round(length / 2.6))
    levels = max(1, round(rack.height_m / 1.35))
    bay, level = length / bays, rack.height_m / levels

    def place(s: float, t: float, z: float, ds: float, dt: float, dz: float) -> Mesh:
        """A box at s along and t across the rack's centre."""
        if along_x:
            return box((rack.x_m + s, rack.y_m + t, z), (ds, dt, dz))
        return box((rack.x_m + t, rack.y_m + s, z), (dt, ds, dz))

    post = 0.1
    for k in range(bays + 1):
        s = (k / bays - 0.5) * (length - post)
        for t in (-0.5 * (depth - post), 0.5 * (depth - post)):
            yield _UPRIGHT, place(s, t, 0.5 * rack.height_m, post, post, rack.height_m)
        yield _UPRIGHT, place(s, 0.0, 0.93 * rack.height_m, 0.05, depth - post, 0.05)
        yield _UPRIGHT, place(s, 0.0, 0.45 * rack.height_m, 0.05, depth - post, 0.05)
    # No one looks through a rack: what blocks a ray in the physics also blocks the picture.
    yield _BACKING, place(0.0, 0.0, 0.5 * rack.height_m, length - post, 0.04, rack.height_m - 0.1)
    for floor in range(levels):
        base = floor * level
        if floor:
            for t in (-0.5 * (depth - 0.08), 0.5 * (depth - 0.08)):  # a little inside the posts
                yield _BEAM, place(0.0, t, base - 0.06, length - post, 0.06, 0.12)
            yield _DECK, place(0.0, 0.0, base - 0.02, length - post, depth - 0.12, 0.03)
        for k in range(bays):
            for half in (-1, 1):
                # A fixed pattern of sizes and colours: the same layout is the same picture.
                pick = (7 * number + 5 * floor + 3 * k + 2 * (half > 0)) % 11
                s = (k + 0.5) * bay - 0.5 * length + half * 0.235 * bay
                width = (0.34 + 0.012 * (pick % 5)) * bay
                height = (0.38 + 0.05 * (pick % 6)) * level
                yield _PALLET, place(s, 0.0, base + 0.07, 0.40 * bay, 0.88 * depth, 0.13)
                if pick != 4:
                    yield (
                        _CARTONS[pick % len(_CARTONS)],
                        place(s, 0.0, base + 0.135 + 0.5 * height, width, 0.80 * depth, height),
                    )
