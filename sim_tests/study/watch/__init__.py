"""A crossing watched in the browser while it runs: ``awarenav watch``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._watch import WatchOptions, watch_command

__all__ = ["WatchOptions", "watch_command"]

__getattr__ = lazy_names(__name__, {"._watch": ("WatchOptions", "watch_command")})
