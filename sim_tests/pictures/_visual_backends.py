"""Chooses the renderer of a picture world."""

from __future__ import annotations

from .._errors import SimError
from .._names import not_one_of
from ._egl_probe import egl_works
from ._visual_backend import RENDERERS, PictureBackend
from ._visual_backend_egl import EglBackend
from ._visual_backend_gl import GlBackend, gl_works
from ._visual_backend_tiny import TinyBackend


def make_backend(renderer: str) -> PictureBackend:
    """Start the backend called ``renderer``; ``"auto"`` takes the quickest that works here.

    Raises:
        SimError: for an unknown name, and for ``"gl"`` or ``"egl"`` where that does not work.
    """
    if renderer not in RENDERERS:
        raise SimError(not_one_of("renderer", renderer, RENDERERS))
    if renderer == "gl" or (renderer == "auto" and gl_works()):
        return GlBackend()
    if renderer == "tiny" or (renderer == "auto" and EglBackend.in_use):
        return TinyBackend()
    if egl_works():
        return EglBackend()
    if renderer == "egl":
        raise SimError(
            "EGL draws no right pictures here (it needs libEGL; Mesa's will do); "
            "use renderer='tiny' or 'auto'"
        )
    return TinyBackend()
