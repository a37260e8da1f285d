"""Lines of sight tested against the surfaces that pictures show, without a picture."""

from __future__ import annotations

from ._sight_lines import PlacedSurface, SightLines
from ._triangles import TriangleSet

__all__ = [
    "PlacedSurface",
    "SightLines",
    "TriangleSet",
]
