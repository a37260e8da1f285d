"""Scenarios on the command line, and their people's attention measured: ``awarenav scenario``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._attention_check import AttentionCheck, check_attention

__all__ = ["AttentionCheck", "check_attention"]

__getattr__ = lazy_page(__name__, __file__)
