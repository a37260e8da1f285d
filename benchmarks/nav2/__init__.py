"""Crossings under a Nav2 that runs in real time."""

from __future__ import annotations

from ._results import summary, table

__all__ = ["summary", "table"]
