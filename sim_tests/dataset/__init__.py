"""Rendered images of people, with the truth about each person: ``awarenav render``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._config import RenderConfig, parse_image_size
    from ._render import render
    from ._scene import RenderScene, random_pose

__getattr__ = lazy_page(__name__, __file__)
