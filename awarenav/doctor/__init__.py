"""Findings about an installation and a camera: ``awarenav doctor``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._findings import Finding, by_importance
    from ._pictures import picture_figures

__all__ = ["Finding", "by_importance", "picture_figures"]

__getattr__ = lazy_page(__name__, __file__)
