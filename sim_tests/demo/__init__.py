"""The demonstration: ``awarenav demo``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._lanes import reported_table, reported_text

__getattr__ = lazy_page(__name__, __file__)
