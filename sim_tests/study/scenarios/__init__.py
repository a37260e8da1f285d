"""Scenarios on the command line, and their people's attention measured: ``awarenav scenario``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._attention_check import AttentionCheck, check_attention

__all__ = ["AttentionCheck", "check_attention"]

__getattr__ = lazy_names(__name__, {"._attention_check": ("AttentionCheck", "check_attention")})
