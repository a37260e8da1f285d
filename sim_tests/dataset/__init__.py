"""Rendered images of people, with the truth about each person: ``awarenav render``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._config import RenderConfig, parse_image_size
    from ._render import render
    from ._scene import RenderScene, random_pose

__all__ = [
    "RenderConfig",
    "RenderScene",
    "parse_image_size",
    "random_pose",
    "render",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._config": (
            "RenderConfig",
            "parse_image_size",
        ),
        "._render": ("render",),
        "._scene": (
            "RenderScene",
            "random_pose",
        ),
    },
)
