"""Rendered pictures of people with the truth about each of them: ``awarenav render``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._config import RenderConfig
    from ._render import render
    from ._scene import RenderScene, random_pose

__all__ = [
    "RenderConfig",
    "RenderScene",
    "random_pose",
    "render",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._config": ("RenderConfig",),
        "._render": ("render",),
        "._scene": (
            "RenderScene",
            "random_pose",
        ),
    },
)
