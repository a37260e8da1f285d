"""The robot: its physics and its looks."""

from __future__ import annotations

from ._amr import NOVA_CARTER, Amr
from ._look import AmrLook

__all__ = ["NOVA_CARTER", "Amr", "AmrLook"]
