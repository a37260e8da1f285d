"""The render world: the bodies that cameras see, drawn by OpenGL or by PyBullet's own renderer."""

from __future__ import annotations

from ._backend import RENDERERS, Drawing, RendererName, RenderView, box_corners, in_view, to_camera
from ._backend_gl import gl_works
from ._visuals import VisualActor, Visuals
