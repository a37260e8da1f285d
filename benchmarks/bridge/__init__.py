"""Throughput, latency and processor time of ``awarenav bridge``."""

from __future__ import annotations

from ._cli import main

__all__ = ["main"]
