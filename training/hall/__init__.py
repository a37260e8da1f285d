"""The looks of halls and robot: ``python -m training.hall`` makes the files for ``sim_tests``.

Textures are painted with noise, bands, polygons and text only, so nobody else's pictures are in
them. Meshes of props and of the robot are put together from boxes and tubes.
"""

from __future__ import annotations

from ._paint import atlases, textures
from ._prop_meshes import prop_meshes
from ._robot_meshes import base_pieces, robot_meshes
from ._round_meshes import ellipsoid, tube

__all__ = [
    "atlases",
    "base_pieces",
    "ellipsoid",
    "prop_meshes",
    "robot_meshes",
    "textures",
    "tube",
]
