"""The warehouse hall as data and meshes: layouts, racks, goods, props, textures and lighting."""

from __future__ import annotations

from ._layout import LAYOUTS, RackBox, WarehouseLayout
from ._lighting import LIGHTINGS, Lighting
from ._meshes import (
    BOX_FACES,
    Colour,
    Mesh,
    Region,
    SceneryChunk,
    box,
    merge,
    quad,
    read_meshes,
)
from ._props import PROP_PARTS, Prop
from ._scenery import scenery
from ._textures import TEXTURE_NAMES, Atlas, scenery_texture

__all__ = [
    "BOX_FACES",
    "LAYOUTS",
    "LIGHTINGS",
    "PROP_PARTS",
    "TEXTURE_NAMES",
    "Atlas",
    "Colour",
    "Lighting",
    "Mesh",
    "Prop",
    "RackBox",
    "Region",
    "SceneryChunk",
    "WarehouseLayout",
    "box",
    "merge",
    "quad",
    "read_meshes",
    "scenery",
    "scenery_texture",
]
