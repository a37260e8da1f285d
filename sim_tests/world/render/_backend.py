"""What a renderer of the picture world offers, whichever library draws."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall import Lighting, Mesh
from ._view import RenderView

BackendName = Literal["tiny", "gl"]
RendererName = Literal["tiny", "gl", "auto"]
RENDERERS: Final[tuple[RendererName, ...]] = ("tiny", "gl", "auto")
BACKGROUND_RGB: Final = (255, 255, 255)


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """What a backend has drawn: one row and column a sample.

    Attributes:
        rgb: (h, w, 3) uint8; white where there is nothing.
        depth_m: (h, w) along the optical axis; infinite where there is nothing.
        body_ids: (h, w) int32, −1 where there is nothing.
    """

    rgb: NDArray[np.uint8]
    depth_m: FloatArray
    body_ids: NDArray[np.int32]


class PictureBackend(Protocol):
    """A PyBullet client of its own that only draws.

    ``shares_textures`` says that shapes with one picture keep one copy of it.
    """

    name: BackendName
    client: int
    shares_textures: bool

    def close(self) -> None:
        """End the client; a second call does nothing."""
        ...

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a picture (H, W, 3); returns its number for :meth:`shape`."""
        ...

    def shape(self, mesh: Mesh, colour: tuple[float, float, float], texture: int | None) -> int:
        """Register a visual shape; returns PyBullet's id of it."""
        ...

    def dress(self, body: int, link: int, shape: int, texture: int | None) -> None:
        """Let a link (−1: base) show its shape, with the texture that was registered with it."""
        ...

    def hide(self, body: int) -> None:
        """Draw a body no longer, in no buffer."""
        ...

    def reveal(self, body: int) -> None:
        """Draw a hidden body again."""
        ...

    def draw(self, view: RenderView, light: Lighting, least_depth_m: float) -> Drawing:
        """Draw the view as if the light were white and cast no shadows.

        Nothing in it is nearer than ``least_depth_m``.
        """
        ...
