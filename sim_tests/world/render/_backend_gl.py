"""Drawing with OpenGL without a window: the quickest, on Mesa's software rasteriser as well.

Bodies live in a PyBullet client of their own, as with the other renderers, which knows their poses;
what they look like is kept here. One picture takes one pass: beside the colour it writes the
distance itself, which no near plane coarsens, and the body's number. moderngl is part of the
optional dependency ``awarenav[sim]``.
"""

from __future__ import annotations

import os
import sys
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from perception.arrays import FloatArray

from ..bullet import pybullet
from ..errors import SimError
from ..hall import Lighting, Mesh
from ._backend import BackendName, Drawing
from ._view import RenderView

_VERTEX_SHADER: Final = """
#version 330
uniform mat4 clip_body;
uniform mat3 odom_body;
in vec3 position;
in vec3 normal;
in vec2 uv;
out vec3 facing;
out vec2 texel;
out float depth;
void main() {
    gl_Position = clip_body * vec4(position, 1.0);
    facing = odom_body * normal;
    texel = uv;
    depth = gl_Position.w;
}
"""
_FRAGMENT_SHADER: Final = """
#version 330
uniform sampler2D picture;
uniform vec3 colour;
uniform vec3 lamp;
uniform vec2 strength;
uniform float mark;
in vec3 facing;
in vec2 texel;
in float depth;
layout(location = 0) out vec4 out_colour;
layout(location = 1) out vec2 out_depth_and_mark;
void main() {
    float lit = strength.x + strength.y * max(dot(normalize(facing), lamp), 0.0);
    out_colour = vec4(texture(picture, texel).rgb * colour * lit, 1.0);
    out_depth_and_mark = vec2(depth, mark);
}
"""
# What PyBullet holds in place of a shape: it never draws it.
_STAND_IN_M: Final = 0.01
# Buffers are cleared with ones, so a body's mark is its number and two more.
_FIRST_MARK: Final = 2


class _Shape:
    """A mesh on its way to the rasteriser."""

    __slots__ = ("array", "buffers", "colour", "texture")

    def __init__(self, array: Any, buffers: tuple[Any, ...], colour: Any, texture: Any) -> None:
        self.array, self.buffers, self.colour, self.texture = array, buffers, colour, texture


class GlBackend:
    """See :class:`PictureBackend`.

    Raises:
        SimError: when moderngl is not installed or finds no OpenGL 3.3 here.
    """

    name: BackendName = "gl"
    shares_textures = True

    def __init__(self) -> None:
        self.client = -1
        self._context, self._program = _start(os.getpid())
        client: int = pybullet.connect(pybullet.DIRECT)
        if client < 0:
            raise SimError("PyBullet could not start another picture world")
        self.client = client
        self._textures = [self._upload(np.full((1, 1, 3), 255, dtype=np.uint8))]
        self._shapes: dict[int, _Shape] = {}
        # What each body shows, by link (−1: base).
        self._bodies: dict[int, list[tuple[int, _Shape]]] = {}
        self._hidden: set[int] = set()
        self._target: Any = None

    def close(self) -> None:
        """End the client and give back what the pictures were drawn from."""
        if self.client < 0:
            return
        pybullet.disconnect(physicsClientId=self.client)
        self.client = -1
        with self._context:
            for shape in self._shapes.values():
                for buffer in (shape.array, *shape.buffers):
                    buffer.release()
            for texture in self._textures:
                texture.release()
            if self._target is not None:
                _release_target(self._target)

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a picture (H, W, 3)."""
        self._textures.append(self._upload(rgb))
        return len(self._textures) - 1

    def shape(self, mesh: Mesh, colour: tuple[float, float, float], texture: int | None) -> int:
        """Register a visual shape with its texture."""
        number = int(
            pybullet.createVisualShape(
                pybullet.GEOM_BOX, halfExtents=[_STAND_IN_M] * 3, physicsClientId=self.client
            )
        )
        uv = np.zeros((len(mesh.vertices_m), 2)) if mesh.uv is None else mesh.uv
        vertices = np.concatenate([mesh.vertices_m, mesh.normals, uv], axis=1).astype(np.float32)
        with self._context:
            buffers = (
                self._context.buffer(vertices.tobytes()),
                self._context.buffer(mesh.indices.astype(np.int32).tobytes()),
            )
            array = self._context.vertex_array(
                self._program,
                [(buffers[0], "3f 3f 2f", "position", "normal", "uv")],
                buffers[1],
            )
        self._shapes[number] = _Shape(array, buffers, colour, self._textures[texture or 0])
        return number

    def dress(self, body: int, link: int, shape: int, texture: int | None) -> None:
        """Remember what a link shows."""
        self._bodies.setdefault(body, []).append((link, self._shapes[shape]))

    def hide(self, body: int) -> None:
        """Draw a body no longer."""
        self._hidden.add(body)

    def reveal(self, body: int) -> None:
        """Draw a hidden body again."""
        self._hidden.discard(body)

    def draw(self, view: RenderView, light: Lighting, least_depth_m: float) -> Drawing:
        """Draw the view as if the light were white, in one pass."""
        towards = np.asarray(light.direction_odom, dtype=np.float64)
        with self._context:
            target = self._target_of(view.width, view.height)
            part = (0, 0, view.width, view.height)
            target.use()
            target.viewport = part
            self._context.enable(self._context.DEPTH_TEST)
            target.clear(1.0, 1.0, 1.0, 1.0, viewport=part)
            program = self._program
            program["lamp"].value = tuple((towards / float(np.linalg.norm(towards))).tolist())
            program["strength"].value = (light.ambient, light.diffuse)
            self._draw_bodies(_clip_odom(view))
            return _read(target, part)

    def _draw_bodies(self, clip_odom: FloatArray) -> None:
        """Draw every body that is not hidden where PyBullet has it."""
        parts: list[tuple[int, _Shape]] = []
        places: list[tuple[float, ...]] = []
        for body, shown in self._bodies.items():
            if body in self._hidden:
                continue
            for link, shape in shown:
                parts.append((body, shape))
                places.append(self._place(body, link))
        if not parts:
            return
        where = np.array(places)
        T_odom_body = np.zeros((len(parts), 4, 4))
        T_odom_body[:, :3, :3] = Rotation.from_quat(where[:, 3:]).as_matrix()
        T_odom_body[:, :3, 3] = where[:, :3]
        T_odom_body[:, 3, 3] = 1.0
        # Column by column, as OpenGL takes them.
        clips = np.swapaxes(clip_odom @ T_odom_body, 1, 2).astype(np.float32)
        turns = np.swapaxes(T_odom_body[:, :3, :3], 1, 2).astype(np.float32)
        clip, turn, colour, mark = (
            self._program[name] for name in ("clip_body", "odom_body", "colour", "mark")
        )
        for (body, shape), to_clip, to_odom in zip(parts, clips, turns, strict=True):
            clip.write(to_clip.tobytes())
            turn.write(to_odom.tobytes())
            colour.value = shape.colour
            mark.value = float(body + _FIRST_MARK)
            shape.texture.use(0)
            shape.array.render()

    def _place(self, body: int, link: int) -> tuple[float, ...]:
        """Position and quaternion of a link in odom."""
        if link < 0:
            position, turn = pybullet.getBasePositionAndOrientation(
                body, physicsClientId=self.client
            )
        else:
            state = pybullet.getLinkState(
                body, link, computeForwardKinematics=1, physicsClientId=self.client
            )
            position, turn = state[4], state[5]
        return (*position, *turn)

    def _upload(self, rgb: NDArray[np.uint8]) -> Any:
        """A texture whose first row is the picture's last, as texture coordinates count."""
        height, width = rgb.shape[:2]
        with self._context:
            texture = self._context.texture(
                (width, height), 3, np.ascontiguousarray(rgb[::-1]).tobytes(), alignment=1
            )
            texture.filter = (self._context.NEAREST, self._context.NEAREST)
        return texture

    def _target_of(self, width: int, height: int) -> Any:
        """What to draw into, at least so large; it grows with the pictures asked for."""
        target = self._target
        if target is None or target.width < width or target.height < height:
            if target is not None:
                width, height = max(width, target.width), max(height, target.height)
                _release_target(target)
            target = self._context.framebuffer(
                [
                    self._context.renderbuffer((width, height), 4),
                    self._context.renderbuffer((width, height), 2, dtype="f4"),
                ],
                self._context.depth_renderbuffer((width, height)),
            )
            self._target = target
        return target


@lru_cache(maxsize=1)
def gl_works() -> bool:
    """Whether there is OpenGL without a window here; found out once a process."""
    try:
        _start(os.getpid())
    except SimError:
        return False
    return True


@lru_cache(maxsize=1)
def _start(process: int) -> tuple[Any, Any]:
    """The context and the program of this process: all its picture worlds share them."""
    try:
        import moderngl  # noqa: PLC0415
    except ImportError as cause:
        raise SimError(
            "drawing with OpenGL needs moderngl, which is not installed; it is part of the extra "
            "'sim': pip install 'awarenav[sim]', or use renderer='tiny'"
        ) from cause
    try:
        # Elsewhere the system offers contexts without a window by itself.
        where: dict[str, Any] = {"backend": "egl"} if sys.platform == "linux" else {}
        context = moderngl.create_context(standalone=True, require=330, **where)
        return context, context.program(_VERTEX_SHADER, _FRAGMENT_SHADER)
    except Exception as cause:  # of whatever kind the driver's loader raises
        raise SimError(
            f"OpenGL without a window does not start here ({cause}); it needs libEGL (Mesa's will "
            "do); use renderer='tiny' or 'auto'"
        ) from cause


def _clip_odom(view: RenderView) -> FloatArray:
    """(4, 4) from odom to clip space, upside down: the first row read is the picture's first."""
    projection = np.array(view.projection_matrix()).reshape(4, 4).T
    projection[1] *= -1.0
    return np.asarray(projection @ np.array(view.view_matrix()).reshape(4, 4).T)


def _read(target: Any, part: tuple[int, int, int, int]) -> Drawing:
    size = (part[3], part[2])
    rgba = np.frombuffer(target.read(part, components=4, attachment=0), dtype=np.uint8)
    data = np.frombuffer(
        target.read(part, components=2, attachment=1, dtype="f4"), dtype=np.float32
    )
    depth, mark = data.reshape(*size, 2)[..., 0], data.reshape(*size, 2)[..., 1]
    body_ids = mark.astype(np.int32) - _FIRST_MARK
    depth_m = depth.astype(np.float64)
    depth_m[body_ids < 0] = np.inf
    return Drawing(np.ascontiguousarray(rgba.reshape(*size, 4)[..., :3]), depth_m, body_ids)


def _release_target(target: Any) -> None:
    for attachment in (*target.color_attachments, target.depth_attachment):
        attachment.release()
    target.release()
