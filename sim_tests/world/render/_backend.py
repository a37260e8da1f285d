"""The interface of the renderers, and the drawing that each of them returns."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Final, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..hall import Colour, Lighting, Mesh
from ._view import RenderView

BackendName = Literal["tiny", "gl"]
RendererName = Literal["tiny", "gl", "auto"]
RENDERERS: Final[tuple[RendererName, ...]] = ("tiny", "gl", "auto")


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The result of a backend: one row and column per sample of the view.

    Attributes:
        rgb: (h, w, 3) uint8; white where there is nothing.
        depth_m: (h, w) along the optical axis; infinite where there is nothing.
        body_ids: (h, w) int32, −1 where there is nothing.
    """

    rgb: NDArray[np.uint8]
    depth_m: FloatArray
    body_ids: NDArray[np.int32]


def texture_key(rgb: NDArray[np.uint8]) -> bytes:
    """Return a hash of a texture's shape and texels."""
    return hashlib.blake2b(
        np.ascontiguousarray(rgb).data, digest_size=16, salt=str(rgb.shape).encode()[:16]
    ).digest()


class RenderBackend(Protocol):
    """A PyBullet client without physics, and a renderer for its bodies."""

    name: BackendName
    client: int

    def close(self) -> None:
        """End the client; a second call does nothing."""
        ...

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a texture (H, W, 3); return its number for :meth:`shape`."""
        ...

    def shape(self, mesh: Mesh, colour: Colour, texture: int | None) -> int:
        """Register a visual shape, with uv if it has a texture; return PyBullet's id of it."""
        ...

    def attach(self, body: int, link: int, shape: int) -> None:
        """Draw a shape on a link (−1: base)."""
        ...

    def hide(self, body: int) -> None:
        """Stop drawing a body, in every buffer."""
        ...

    def reveal(self, body: int) -> None:
        """Draw a hidden body again."""
        ...

    def draw(self, view: RenderView, light: Lighting) -> Drawing:
        """Draw the view as if the light were white and cast no shadows."""
        ...
