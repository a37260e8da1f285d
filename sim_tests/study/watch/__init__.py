"""A crossing watched in the browser while it runs: ``awarenav watch``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._watch import WatchOptions, watch_command

__all__ = ["WatchOptions", "watch_command"]

__getattr__ = lazy_page(__name__, __file__)
