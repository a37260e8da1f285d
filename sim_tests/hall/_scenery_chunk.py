"""One local piece of scenery, as it is drawn."""

from __future__ import annotations

from dataclasses import dataclass

from ._meshes import Mesh

Colour = tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class SceneryChunk:
    """A piece of scenery small enough to be left out where the camera does not see it.

    Attributes:
        mesh: in odom, metres, with texture coordinates.
        colour: RGB, 0 to 1; it multiplies the texture.
        texture: a name for :func:`scenery_texture`, or None for the plain colour.
    """

    mesh: Mesh
    colour: Colour
    texture: str | None
