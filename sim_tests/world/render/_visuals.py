"""The render world: the scenery and the actors that cameras see, apart from the physics."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from contextlib import AbstractContextManager
from types import TracebackType
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ..errors import SimError
from ..hall import Colour, Lighting, Mesh, WarehouseLayout, scenery, scenery_texture
from ._backend import (
    RENDERERS,
    Drawing,
    RenderBackend,
    RendererName,
    RenderView,
    box_corners,
    in_view,
    texture_key,
    to_camera,
)
from ._backend_gl import GlBackend, gl_works
from ._backend_tiny import TinyBackend

_WHITE: Final[Colour] = (1.0, 1.0, 1.0)
# The number that stands for no actor.
_SCENERY: Final = -1


class VisualActor(Protocol):
    """Something that moves and that cameras see."""

    @property
    def kind(self) -> str:
        """The kind of actor: ``"person"``, ``"robot"`` or ``"prop"``."""
        ...

    def bounds_odom_m(self) -> FloatArray:
        """Return the low and high corner (2, 3) of a box around all of it now; cheap."""
        ...

    def bodies(
        self, visuals: Visuals, samples_per_m: float, view: RenderView
    ) -> tuple[Sequence[int], FloatArray]:
        """Return its bodies that the next image may show, and their poses (N, 4, 4) in odom.

        Bodies are made by :meth:`Visuals.add_body` when they are first needed. The others that it
        has made are hidden.

        Args:
            visuals: the render world, always the same one.
            samples_per_m: samples of the image per metre of the actor, for its level of detail.
            view: the view of the next image; bodies outside it may be left out.
        """
        ...


class Visuals(AbstractContextManager["Visuals"]):
    """The render world, apart from the physics; use it in a ``with`` block.

    Scenery stands still; actors move. Before each image, :meth:`prepare` hides the actors outside
    the frustum, which never changes the image.

    Args:
        layout: the hall whose scenery is built; None leaves the world empty.
        renderer: ``"tiny"`` is PyBullet's software renderer, ``"gl"`` is OpenGL without a window,
            and ``"auto"`` is the fastest of the two that works here.
        variant: number of the scenery's variant (goods, colours, wear).

    Attributes:
        renderer: ``"tiny"`` or ``"gl"``, the one in use.

    Raises:
        SimError: for an unknown renderer, and for ``"gl"`` where OpenGL does not start.
    """

    def __init__(
        self,
        layout: WarehouseLayout | None = None,
        renderer: RendererName = "tiny",
        variant: int = 0,
    ) -> None:
        self._backend: RenderBackend = _start_backend(renderer)
        self._closed = False
        self.renderer = self._backend.name
        # Numbers of the textures by content.
        self._textures: dict[bytes, int] = {}
        self._actors: list[VisualActor] = []
        self._scenery: set[int] = set()
        # The actor whose bodies are being made, the actor of each body, the visible ones by actor.
        self._making = _SCENERY
        self._owners: list[int] = []
        self._visible: defaultdict[int, set[int]] = defaultdict(set)
        try:
            if layout is not None:
                self._build_scenery(layout, variant)
        except BaseException:
            self._backend.close()
            raise

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the render world; a second call does nothing."""
        self._closed = True
        self._backend.close()

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a texture (H, W, 3) uint8; equal textures get the same number."""
        image = np.ascontiguousarray(rgb)
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
            raise SimError(
                f"a texture must be uint8 of shape (H, W, 3), got {image.dtype} {image.shape}"
            )
        key = texture_key(image)
        if key not in self._textures:
            self._textures[key] = self._backend.texture(image)
        return self._textures[key]

    def add_body(self, mesh: Mesh, colour: Colour = _WHITE, texture: int | None = None) -> int:
        """Make a rigid body at the origin of odom; return its number.

        The texture, of :meth:`texture`, is multiplied by the colour.
        """
        if texture is not None and mesh.uv is None:
            raise SimError("a mesh with a texture needs uv coordinates")
        body = self._backend.add_body(mesh, colour, texture)
        self._owners.append(self._making)
        self._visible[self._making].add(body)
        return body

    def add_static(self, mesh: Mesh, colour: Colour = _WHITE, texture: int | None = None) -> None:
        """Add a piece of scenery in odom, as :meth:`add_body` does."""
        self._scenery.add(self.add_body(mesh, colour, texture))

    def add_actor(self, actor: VisualActor) -> int:
        """Add something that moves; return its number in :attr:`RenderedView.actors`."""
        self._actors.append(actor)
        return len(self._actors) - 1

    @property
    def actors(self) -> tuple[VisualActor, ...]:
        """The actors in the order of their numbers."""
        return tuple(self._actors)

    def prepare(self, view: RenderView, only: AbstractSet[int] | None = None) -> None:
        """Pose the actors in view, and hide the others."""
        if self._closed:
            raise SimError("the render world is closed: it cannot draw any more")
        self._show(_SCENERY, self._scenery if only is None else set())
        bounds = np.array([actor.bounds_odom_m() for actor in self._actors], dtype=np.float64)
        corners_camera_m = to_camera(view, box_corners(bounds.reshape(-1, 2, 3)))
        seen = in_view(view, corners_camera_m).tolist()
        for number, actor in enumerate(self._actors):
            bodies: Sequence[int] = ()
            if seen[number] and (only is None or number in only):
                depth = max(float(corners_camera_m[number, :, 2].mean()), view.near_m)
                self._making = number
                bodies, T_odom_bodies = actor.bodies(self, view.samples_per_m / depth, view)
                self._making = _SCENERY
                self._backend.place(bodies, T_odom_bodies)
            self._show(number, set(bodies))

    def _show(self, actor: int, bodies: set[int]) -> None:
        """Draw these bodies of an actor from now on, and none of its others."""
        visible = self._visible[actor]
        for body in visible - bodies:
            self._backend.hide(body)
        for body in bodies - visible:
            self._backend.reveal(body)
        self._visible[actor] = set(bodies)

    def draw(self, view: RenderView, light: Lighting) -> Drawing:
        """Draw the bodies that are not hidden; :meth:`prepare` is called with the view before."""
        return self._backend.draw(view, light)

    def actor_numbers(self, body_ids: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the number of the actor that each body belongs to, −1 for scenery and nothing."""
        # Id −1, which stands for "nothing", is the last row.
        owners = np.array([*self._owners, _SCENERY], dtype=np.int32)
        return np.asarray(owners[body_ids])

    def _build_scenery(self, layout: WarehouseLayout, variant: int) -> None:
        chunks = scenery(layout, variant)
        textures = {
            name: None if name is None else self.texture(scenery_texture(name))
            for name in dict.fromkeys(chunk.texture for chunk in chunks)
        }
        for chunk in chunks:
            self.add_static(chunk.mesh, chunk.colour, textures[chunk.texture])


def _start_backend(renderer: str) -> RenderBackend:
    """Start the backend of this name; ``"auto"`` takes the fastest that works here."""
    if renderer not in RENDERERS:
        raise SimError(not_one_of("renderer", renderer, RENDERERS))
    if renderer == "gl" or (renderer == "auto" and gl_works()):
        return GlBackend()
    return TinyBackend()
