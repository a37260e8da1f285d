"""The textures of the simulated halls and the robot: ``python -m training.hall`` paints them.

They are painted with noise, bands, polygons and text only, so nobody else's pictures are in them.
"""

from __future__ import annotations

from ._paint import atlases, textures

__all__ = ["atlases", "textures"]
