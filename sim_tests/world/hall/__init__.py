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
    ellipsoid,
    merge,
    quad,
    tube,
)
from ._props import PROP_PARTS, Prop
from ._scenery import scenery
from ._textures import AMR_ATLAS, TEXTURE_NAMES, scenery_texture

__all__ = [
    "AMR_ATLAS",
    "BOX_FACES",
    "LAYOUTS",
    "LIGHTINGS",
    "PROP_PARTS",
    "TEXTURE_NAMES",
    "Colour",
    "Lighting",
    "Mesh",
    "Prop",
    "RackBox",
    "Region",
    "SceneryChunk",
    "WarehouseLayout",
    "box",
    "ellipsoid",
    "merge",
    "quad",
    "scenery",
    "scenery_texture",
    "tube",
]
