"""The picture world: all that a camera sees, apart from the physics."""

from __future__ import annotations

import hashlib
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from awarenav.closing import Closing
from awarenav.errors import not_one_of
from perception.arrays import FloatArray

from ..bullet import pybullet
from ..errors import SimError
from ..hall import Colour, Lighting, Mesh, WarehouseLayout, scenery, scenery_texture
from ._backend import RENDERERS, Drawing, PictureBackend, RendererName
from ._backend_gl import GlBackend, gl_works
from ._backend_tiny import TinyBackend
from ._culling import box_corners, hidden_behind, in_view, least_depth_m, to_camera
from ._texture_islands import cut_texture
from ._view import RenderView


def make_backend(renderer: str) -> PictureBackend:
    """Start the backend called ``renderer``; ``"auto"`` takes the quickest that works here.

    Raises:
        SimError: for an unknown name, and for ``"gl"`` where that does not work.
    """
    if renderer not in RENDERERS:
        raise SimError(not_one_of("renderer", renderer, RENDERERS))
    if renderer == "gl" or (renderer == "auto" and gl_works()):
        return GlBackend()
    return TinyBackend()


WHITE: Final[Colour] = (1.0, 1.0, 1.0)

# A rack is closed at its ends, on top and along its middle: whatever enters its box meets a wall of
# it. The box that hides is this much smaller on every side.
_RACK_SKIN_M: Final = 0.05


class VisualActor(Protocol):
    """Something that moves and is seen."""

    @property
    def kind(self) -> str:
        """``"person"``, ``"robot"`` or ``"prop"``."""
        ...

    def bounds_odom_m(self) -> FloatArray:
        """(2, 3) low and high corner of a box that holds all of it now; cheap."""
        ...

    def build(self, visuals: Visuals) -> None:
        """Make its bodies in the picture world; called once, before it is first drawn."""
        ...

    def show(self, pixels_per_m: float | None, view: RenderView | None = None) -> None:
        """Pose its bodies for the coming picture at this level of detail; None: hide them.

        An actor of many bodies may hide those that ``view`` does not show; None shows them all.
        """
        ...

    def bodies(self) -> AbstractSet[int]:
        """Ids of its bodies in the picture world."""
        ...


class Visuals(Closing):
    """Bodies without physics in a PyBullet client of its own; close it, or use it in a ``with``.

    Scenery stands still; actors move. Before a picture, :meth:`prepare` hides what that picture
    does not show: outside the frustum, between the samples, or behind a rack.

    Args:
        layout: the hall whose scenery is built; None leaves the world empty.
        renderer: ``"tiny"`` is PyBullet's software renderer, ``"gl"`` OpenGL without a window,
            and ``"auto"`` the quickest that works.
        variant: number of the scenery's variant (goods, colours, wear).

    Attributes:
        client: PyBullet's id of this world.
        renderer: ``"tiny"`` or ``"gl"``, the one in use.
        culling: whether :meth:`prepare` hides what is not seen; the pictures are the same.

    Raises:
        SimError: when a renderer is asked for that does not work here.
    """

    def __init__(
        self,
        layout: WarehouseLayout | None = None,
        renderer: RendererName = "tiny",
        variant: int = 0,
    ) -> None:
        self.culling = True
        self._backend: PictureBackend = make_backend(renderer)
        self.renderer = self._backend.name
        self._pictures: list[NDArray[np.uint8]] = []
        self._numbers: dict[bytes, int] = {}
        self._loaded: dict[bytes, int] = {}
        self._texture_of_shape: dict[int, int] = {}
        self._actors: list[VisualActor] = []
        self._built: set[int] = set()
        self._shown_actors: set[int] = set()
        self._static_bodies: list[int] = []
        self._static_corners: FloatArray = np.zeros((0, 8, 3))
        self._static_shown: NDArray[np.bool_] = np.zeros(0, dtype=bool)
        self._occluders: FloatArray = np.zeros((0, 2, 3))
        self._actor_numbers = np.full(1, -1, dtype=np.int32)
        try:
            if layout is not None:
                self._build_scenery(layout, variant)
        except BaseException:
            self._backend.close()
            raise

    @property
    def client(self) -> int:
        """PyBullet's id of this world; −1 once it is closed."""
        return self._backend.client

    def close(self) -> None:
        """End the picture world; a second call does nothing."""
        self._backend.close()

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a picture (H, W, 3) uint8; equal pictures get the same number."""
        image = np.ascontiguousarray(rgb)
        if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3 or not image.size:
            raise SimError(
                f"a texture must be uint8 of shape (H, W, 3), got {image.dtype} {image.shape}"
            )
        key = _key(image)
        if key not in self._numbers:
            self._numbers[key] = len(self._pictures)
            self._pictures.append(image)
        return self._numbers[key]

    def shape(self, mesh: Mesh, colour: Colour = WHITE, texture: int | None = None) -> int:
        """Register a visual shape for :meth:`add_body`; returns PyBullet's id of it.

        A texture multiplies the colour.
        """
        if texture is None:
            return self._backend.shape(mesh, colour, None)
        if mesh.uv is None:
            raise SimError("a mesh with a texture needs uv coordinates")
        uv, picture = mesh.uv, self._pictures[texture]
        if self._backend.shares_textures:
            key = texture.to_bytes(8, "little")
        else:
            uv, picture = cut_texture(uv, mesh.indices.ravel(), picture)
            key = _key(picture)
        if key not in self._loaded:
            self._loaded[key] = self._backend.texture(picture)
        loaded = self._loaded[key]
        shape = self._backend.shape(replace(mesh, uv=uv), colour, loaded)
        self._texture_of_shape[shape] = loaded
        return shape

    def add_body(
        self,
        shape: int,
        link_shapes: tuple[int, ...] = (),
        joints_m: FloatArray | None = None,
        parents: tuple[int, ...] = (),
    ) -> int:
        """Make a textured body of one shape, or of a tree of shapes held by spherical joints.

        Args:
            shape: of the base, −1 for none.
            link_shapes: of the links, −1 for none.
            joints_m: (L, 3) each link's joint in the frame of its parent.
            parents: row of each link's parent among the links, −1 for the base.

        Returns:
            PyBullet's id; link i is its joint i.
        """
        count = len(link_shapes)
        origins = np.zeros((count, 3)) if joints_m is None else np.asarray(joints_m)
        above = parents or (-1,) * count
        links = {
            "linkMasses": [0.0] * count,
            "linkCollisionShapeIndices": [-1] * count,
            "linkVisualShapeIndices": list(link_shapes),
            "linkPositions": origins.tolist(),
            "linkOrientations": [(0.0, 0.0, 0.0, 1.0)] * count,
            "linkInertialFramePositions": [(0.0, 0.0, 0.0)] * count,
            "linkInertialFrameOrientations": [(0.0, 0.0, 0.0, 1.0)] * count,
            "linkParentIndices": [parent + 1 for parent in above],
            "linkJointTypes": [pybullet.JOINT_SPHERICAL] * count,
            "linkJointAxis": [(0.0, 0.0, 1.0)] * count,
        }
        body = int(
            pybullet.createMultiBody(
                0.0,
                -1,
                shape,
                useMaximalCoordinates=not count,
                physicsClientId=self.client,
                **(links if count else {}),
            )
        )
        for link, own in enumerate((shape, *link_shapes), start=-1):
            if own >= 0:
                self._backend.dress(body, link, own, self._texture_of_shape.get(own))
        return body

    def add_static(self, mesh: Mesh, colour: Colour = WHITE, texture: int | None = None) -> int:
        """Add a piece of scenery in odom; it is drawn when its box is in view."""
        body = self.add_body(self.shape(mesh, colour, texture))
        bounds = np.array([mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)])
        self._static_bodies.append(body)
        self._static_corners = np.concatenate([self._static_corners, box_corners(bounds[None])])
        self._static_shown = np.append(self._static_shown, True)
        return body

    def add_actor(self, actor: VisualActor) -> int:
        """Add something that moves; returns its number in :attr:`RenderedView.actors`."""
        self._actors.append(actor)
        return len(self._actors) - 1

    @property
    def actors(self) -> tuple[VisualActor, ...]:
        """Every actor by its number."""
        return tuple(self._actors)

    @property
    def statics(self) -> int:
        """How many pieces of scenery there are."""
        return len(self._static_bodies)

    @property
    def shown_statics(self) -> int:
        """How many of them the last picture drew."""
        return int(np.count_nonzero(self._static_shown))

    def hide(self, body: int) -> None:
        """Draw a body no longer, in no buffer; it must be revealed before it is posed again."""
        self._backend.hide(body)

    def reveal(self, body: int) -> None:
        """Draw a hidden body again, where it was."""
        self._backend.reveal(body)

    def prepare(self, view: RenderView, only: AbstractSet[int] | None = None) -> float:
        """Hide what the view does not show and let every actor in it take its pose.

        Args:
            view: of the coming picture.
            only: numbers of actors to draw alone, without scenery.

        Returns:
            A depth in metres that nothing seen is nearer than.
        """
        if self.client < 0:
            raise SimError("the picture world is closed: it can no longer draw")
        corners = self._static_corners if only is None else self._static_corners[:0]
        statics = len(corners)
        if self._actors:
            bounds = np.array([actor.bounds_odom_m() for actor in self._actors], dtype=np.float64)
            corners = np.concatenate([corners, box_corners(bounds)])
        in_camera = to_camera(view, corners)
        if self.culling:
            shown = in_view(view, in_camera)
            if only is None:
                rows = np.flatnonzero(shown)
                shown[rows] &= ~hidden_behind(view, corners[rows], self._occluders)
        else:
            shown = np.ones(len(corners), dtype=bool)
        least = least_depth_m(view, in_camera[shown]) if shown.any() else np.array([view.near_m])
        self._show_statics(
            shown[:statics] if only is None else np.zeros(len(self._static_bodies), dtype=bool)
        )
        self._show_actors(view, shown[statics:], in_camera[statics:], only)
        return float(least.min())

    def draw(self, view: RenderView, light: Lighting, least_depth_m: float) -> Drawing:
        """Draw the view as :meth:`prepare` has left the world."""
        return self._backend.draw(view, light, least_depth_m)

    def actor_numbers(self, body_ids: NDArray[np.int32]) -> NDArray[np.int32]:
        """Number of the actor that each body id belongs to, −1 for scenery and nothing."""
        self._grow_numbers(int(body_ids.max(initial=-1)))
        # Row −1, the last, stands for "nothing".
        return np.asarray(self._actor_numbers[body_ids])

    def _show_statics(self, shown: NDArray[np.bool_]) -> None:
        for row in np.flatnonzero(shown != self._static_shown).tolist():
            if shown[row]:
                self._backend.reveal(self._static_bodies[row])
            else:
                self._backend.hide(self._static_bodies[row])
        self._static_shown = shown

    def _show_actors(
        self,
        view: RenderView,
        shown: NDArray[np.bool_],
        corners_camera_m: FloatArray,
        only: AbstractSet[int] | None,
    ) -> None:
        for number, actor in enumerate(self._actors):
            if shown[number] and (only is None or number in only):
                if number not in self._built:
                    actor.build(self)
                    self._built.add(number)
                depth = max(float(corners_camera_m[number, :, 2].mean()), view.near_m)
                actor.show(view.samples_per_m / depth, view if self.culling else None)
                self._shown_actors.add(number)
                self._enter(number, actor.bodies())
            elif number in self._shown_actors:
                actor.show(None)
                self._shown_actors.discard(number)

    def _enter(self, number: int, bodies: AbstractSet[int]) -> None:
        """Remember whose bodies these are; an actor may make more as it comes closer."""
        self._grow_numbers(max(bodies, default=-1))
        for body in bodies:
            self._actor_numbers[body] = number

    def _grow_numbers(self, highest_body: int) -> None:
        size = len(self._actor_numbers)
        if highest_body + 2 > size:
            grown = np.full(max(highest_body + 2, 2 * size), -1, dtype=np.int32)
            grown[: size - 1] = self._actor_numbers[:-1]
            self._actor_numbers = grown

    def _build_scenery(self, layout: WarehouseLayout, variant: int) -> None:
        chunks = scenery(layout, variant)
        textures = {
            name: None if name is None else self.texture(scenery_texture(name))
            for name in dict.fromkeys(chunk.texture for chunk in chunks)
        }
        for chunk in chunks:
            self.add_static(chunk.mesh, chunk.colour, textures[chunk.texture])
        self._occluders = _solid_racks(layout)


def _key(picture: NDArray[np.uint8]) -> bytes:
    """Equal for equal pictures."""
    return hashlib.blake2b(
        np.ascontiguousarray(picture).data, digest_size=16, salt=str(picture.shape).encode()[:16]
    ).digest()


def _solid_racks(layout: WarehouseLayout) -> FloatArray:
    """(M, 2, 3) boxes just inside the racks, which nobody sees through."""
    boxes = [
        ((x_min, y_min, -_RACK_SKIN_M), (x_max, y_max, rack.height_m))
        for rack in layout.racks
        for x_min, y_min, x_max, y_max in (rack.box_odom_m,)
    ]
    solid = np.array(boxes, dtype=np.float64).reshape(-1, 2, 3)
    solid[:, 0] += _RACK_SKIN_M
    solid[:, 1] -= _RACK_SKIN_M
    return solid
