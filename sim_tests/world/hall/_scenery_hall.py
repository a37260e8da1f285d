"""Meshes of the building: floor slab, walls with doors and signs, ceiling with beams and lamps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from perception.arrays import FloatArray

from ._layout import WarehouseLayout
from ._meshes import WHOLE, Colour, Mesh, Region, SceneryChunk, box, merge, quad
from ._textures import FIXTURE_ATLAS, GOODS_ATLAS, TILE_M

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
    "number0": (0.7, 0.7, 3.5),
    "number1": (0.7, 0.7, 3.5),
    "number2": (0.7, 0.7, 3.5),
    "number3": (0.7, 0.7, 3.5),
}
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
    kind = int(rng.integers(5))
    if kind == 0:
        yield "door", middle
        yield "exit", middle
        yield "extinguisher", middle + 1.1
    elif kind == 1:
        yield "board", middle
        yield "clock", middle
    elif kind == 2:
        yield "cabinet", middle - 0.8
        yield "warning", middle + 0.1
        yield "pipe", middle - 1.35
    elif kind == 3:
        yield "extinguisher", middle - 0.6
        yield "heater", middle + 0.4
    else:
        yield "duty", middle
        yield "pipe", middle + 1.2
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
