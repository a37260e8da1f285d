"""Lines of sight tested against the rendered surfaces of hall, people and robot, without images."""

from __future__ import annotations

from ._sight_lines import PlacedSurface, SightLines
from ._triangles import TriangleSet

__all__ = [
    "PlacedSurface",
    "SightLines",
    "TriangleSet",
]
