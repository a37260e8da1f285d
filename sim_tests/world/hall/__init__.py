"""The warehouse hall as data and meshes: layouts, racks, goods, props, textures and lighting."""

from __future__ import annotations

from ._layout import LAYOUTS, LIGHTINGS, PROP_PARTS, Lighting, Prop, RackBox, WarehouseLayout
from ._meshes import (
    BOX_FACES,
    TEXTURE_NAMES,
    Atlas,
    Colour,
    Mesh,
    Region,
    SceneryChunk,
    box,
    merge,
    quad,
    read_meshes,
    scenery_texture,
)
from ._scenery import scenery
