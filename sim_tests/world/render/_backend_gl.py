"""The renderer ``"gl"``: OpenGL 3.3 without a window, through moderngl (extra ``awarenav[sim]``).

It is the fastest renderer, on Mesa's software rasteriser as well, and needs no PyBullet. One pass
draws an image: it writes colour, the depth as a distance (so the near plane does not limit its
precision) and the number of the body.

The OpenGL context comes from EGL on Linux, and from the system (CGL, WGL) on macOS and Windows. It
is tested on Linux only; ``gl_works`` tells whether a context starts, and the renderer ``"auto"``
then falls back to ``"tiny"``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray
from perception.installation import install_command

from ..errors import SimError
from ..hall import Colour, Lighting, Mesh
from ._backend import BackendName, Drawing, RenderBackend, RenderView

_VERTEX_SHADER: Final = """
#version 330
uniform mat4 clip_body;
uniform mat3 odom_body;
in vec3 position;
in vec3 normal;
in vec2 uv;
out vec3 normal_odom;
out vec2 texture_uv;
out float depth;
void main() {
    gl_Position = clip_body * vec4(position, 1.0);
    normal_odom = odom_body * normal;
    texture_uv = uv;
    depth = gl_Position.w;
}
"""
_FRAGMENT_SHADER: Final = """
#version 330
uniform sampler2D surface;
uniform vec3 colour;
uniform vec3 to_light;
uniform vec2 ambient_diffuse;
uniform float label;
in vec3 normal_odom;
in vec2 texture_uv;
in float depth;
layout(location = 0) out vec4 out_colour;
layout(location = 1) out vec2 out_depth_and_label;
void main() {
    float cosine = max(dot(normalize(normal_odom), to_light), 0.0);
    float light = ambient_diffuse.x + ambient_diffuse.y * cosine;
    out_colour = vec4(texture(surface, texture_uv).rgb * colour * light, 1.0);
    out_depth_and_label = vec2(depth, label);
}
"""
# A body's label is its number plus this: buffers are cleared with ones, which label nothing.
_FIRST_LABEL: Final = 2


@dataclass(slots=True, eq=False)
class _Body:
    """A mesh in OpenGL's memory: its vertex array and buffers, colour and texture, and its pose."""

    array: Any
    buffers: tuple[Any, ...]
    colour: Colour
    texture: Any
    T_odom_body: FloatArray
    hidden: bool = False


class GlBackend(RenderBackend):
    """See :class:`RenderBackend`.

    Raises:
        SimError: when moderngl is not installed or finds no OpenGL 3.3 here.
    """

    name: BackendName = "gl"

    def __init__(self) -> None:
        self._context, self._program = _context_and_program(os.getpid())
        self._textures = [self._upload(np.full((1, 1, 3), 255, dtype=np.uint8))]
        self._bodies: list[_Body] = []
        self._framebuffer: Any = None

    def close(self) -> None:
        """Free the memory of meshes, textures and buffers."""
        with self._context:
            for body in self._bodies:
                for buffer in (body.array, *body.buffers):
                    buffer.release()
            for texture in self._textures:
                texture.release()
            if self._framebuffer is not None:
                _release_framebuffer(self._framebuffer)
        self._bodies, self._textures, self._framebuffer = [], [], None

    def texture(self, rgb: NDArray[np.uint8]) -> int:
        """Register a texture (H, W, 3)."""
        self._textures.append(self._upload(rgb))
        return len(self._textures) - 1

    def add_body(self, mesh: Mesh, colour: Colour, texture: int | None) -> int:
        """Upload a mesh with its texture."""
        uv = np.zeros((len(mesh.vertices_m), 2)) if mesh.uv is None else mesh.uv
        vertices = np.concatenate([mesh.vertices_m, mesh.normals, uv], axis=1).astype(np.float32)
        with self._context:
            buffers = (
                self._context.buffer(vertices.tobytes()),
                self._context.buffer(mesh.indices.astype(np.int32).tobytes()),
            )
            array = self._context.vertex_array(
                self._program, [(buffers[0], "3f 3f 2f", "position", "normal", "uv")], buffers[1]
            )
        surface = self._textures[texture or 0]
        self._bodies.append(_Body(array, buffers, colour, surface, np.eye(4)))
        return len(self._bodies) - 1

    def place(self, bodies: Sequence[int], T_odom_bodies: FloatArray) -> None:
        """Move bodies."""
        for body, T_odom_body in zip(bodies, T_odom_bodies, strict=True):
            self._bodies[body].T_odom_body = T_odom_body

    def hide(self, body: int) -> None:
        """Stop drawing a body."""
        self._bodies[body].hidden = True

    def reveal(self, body: int) -> None:
        """Draw a hidden body again."""
        self._bodies[body].hidden = False

    def draw(self, view: RenderView, light: Lighting) -> Drawing:
        """Draw the view as if the light were white, in one pass."""
        towards = np.asarray(light.direction_odom, dtype=np.float64)
        with self._context:
            framebuffer = self._framebuffer_for(view.width, view.height)
            viewport = (0, 0, view.width, view.height)
            framebuffer.use()
            framebuffer.viewport = viewport
            self._context.enable(self._context.DEPTH_TEST)
            framebuffer.clear(1.0, 1.0, 1.0, 1.0, viewport=viewport)
            program = self._program
            program["to_light"].value = tuple((towards / float(np.linalg.norm(towards))).tolist())
            program["ambient_diffuse"].value = (light.ambient, light.diffuse)
            self._draw_bodies(_clip_odom(view))
            return _read(framebuffer, viewport)

    def _draw_bodies(self, clip_odom: FloatArray) -> None:
        shown = [(number, body) for number, body in enumerate(self._bodies) if not body.hidden]
        if not shown:
            return
        T_odom_body = np.stack([body.T_odom_body for _, body in shown])
        # OpenGL takes matrices column by column.
        clip_bodies = np.swapaxes(clip_odom @ T_odom_body, 1, 2).astype(np.float32)
        odom_bodies = np.swapaxes(T_odom_body[:, :3, :3], 1, 2).astype(np.float32)
        clip_uniform, odom_uniform, colour_uniform, label_uniform = (
            self._program[name] for name in ("clip_body", "odom_body", "colour", "label")
        )
        for (number, body), clip_body, odom_body in zip(
            shown, clip_bodies, odom_bodies, strict=True
        ):
            clip_uniform.write(clip_body.tobytes())
            odom_uniform.write(odom_body.tobytes())
            colour_uniform.value = body.colour
            label_uniform.value = float(number + _FIRST_LABEL)
            body.texture.use(0)
            body.array.render()

    def _upload(self, rgb: NDArray[np.uint8]) -> Any:
        """Return an OpenGL texture; its rows are reversed, since v counts from the bottom."""
        height, width = rgb.shape[:2]
        with self._context:
            texture = self._context.texture(
                (width, height), 3, np.ascontiguousarray(rgb[::-1]).tobytes(), alignment=1
            )
            texture.filter = (self._context.NEAREST, self._context.NEAREST)
        return texture

    def _framebuffer_for(self, width: int, height: int) -> Any:
        """Return a framebuffer of at least this size; it grows to the largest image asked for."""
        framebuffer = self._framebuffer
        if framebuffer is None or framebuffer.width < width or framebuffer.height < height:
            if framebuffer is not None:
                width, height = max(width, framebuffer.width), max(height, framebuffer.height)
                _release_framebuffer(framebuffer)
            framebuffer = self._context.framebuffer(
                [
                    self._context.renderbuffer((width, height), 4),
                    self._context.renderbuffer((width, height), 2, dtype="f4"),
                ],
                self._context.depth_renderbuffer((width, height)),
            )
            self._framebuffer = framebuffer
        return framebuffer


@lru_cache(maxsize=1)
def gl_works() -> bool:
    """Return whether OpenGL starts without a window here; it is tried once per process."""
    try:
        _context_and_program(os.getpid())
    except SimError:
        return False
    return True


@lru_cache(maxsize=1)
def _context_and_program(process_id: int) -> tuple[Any, Any]:
    """Return the context and the shader program that all render worlds of a process share."""
    try:
        import moderngl  # noqa: PLC0415
    except ImportError as cause:
        raise SimError(
            "drawing with OpenGL needs moderngl, which is not installed; it is part of the extra "
            f"'sim': {install_command('sim')}, or use renderer='tiny'"
        ) from cause
    try:
        # macOS and Windows offer contexts without a window by themselves.
        backend: dict[str, Any] = {"backend": "egl"} if sys.platform == "linux" else {}
        context = moderngl.create_context(standalone=True, require=330, **backend)
        return context, context.program(_VERTEX_SHADER, _FRAGMENT_SHADER)
    except Exception as cause:  # drivers raise errors of many kinds
        need = "libEGL (Mesa's will do)" if sys.platform == "linux" else "a driver for OpenGL 3.3"
        raise SimError(
            f"OpenGL without a window does not start here ({cause}); it needs {need}; "
            "use renderer='tiny' or 'auto'"
        ) from cause


def _clip_odom(view: RenderView) -> FloatArray:
    """Return (4, 4) from odom to clip space, upside down: OpenGL reads its lowest row first."""
    projection = np.array(view.projection_matrix()).reshape(4, 4).T
    projection[1] *= -1.0
    return np.asarray(projection @ np.array(view.view_matrix()).reshape(4, 4).T)


def _read(framebuffer: Any, viewport: tuple[int, int, int, int]) -> Drawing:
    """Return the drawing in the framebuffer's viewport."""
    size = (viewport[3], viewport[2])
    rgba = np.frombuffer(framebuffer.read(viewport, components=4, attachment=0), dtype=np.uint8)
    data = np.frombuffer(
        framebuffer.read(viewport, components=2, attachment=1, dtype="f4"), dtype=np.float32
    ).reshape(*size, 2)
    depth, label = data[..., 0], data[..., 1]
    body_ids = label.astype(np.int32) - _FIRST_LABEL
    depth_m = depth.astype(np.float64)
    depth_m[body_ids < 0] = np.inf
    return Drawing(np.ascontiguousarray(rgba.reshape(*size, 4)[..., :3]), depth_m, body_ids)


def _release_framebuffer(framebuffer: Any) -> None:
    for attachment in (*framebuffer.color_attachments, framebuffer.depth_attachment):
        attachment.release()
    framebuffer.release()
