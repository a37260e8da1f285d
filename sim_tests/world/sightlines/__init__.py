"""Lines of sight tested against the rendered surfaces of hall, people and robot, without images."""

from __future__ import annotations

from ._sight_lines import Occluder, PlacedSurface, SightLines, cut_surfaces, scenery_surface
from ._triangles import TriangleSet
