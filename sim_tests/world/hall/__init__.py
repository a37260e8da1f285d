"""The warehouse as data and meshes: layouts, racks, goods, props, textures, light."""

from __future__ import annotations

from ._layout import LAYOUTS, WarehouseLayout
from ._lighting import LIGHTINGS, Lighting
from ._meshes import Colour, Mesh, Region, box, ellipsoid, merge, quad, tube
from ._scenery import scenery, scenery_texture
from ._texture_amr import AMR_ATLAS

__all__ = [
    "AMR_ATLAS",
    "LAYOUTS",
    "LIGHTINGS",
    "Colour",
    "Lighting",
    "Mesh",
    "Region",
    "WarehouseLayout",
    "box",
    "ellipsoid",
    "merge",
    "quad",
    "scenery",
    "scenery_texture",
    "tube",
]
