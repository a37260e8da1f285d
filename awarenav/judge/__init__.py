"""Comparison of estimates of people with the truth: ``awarenav judge``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._judge import judge_files, judge_frames
    from ._report import requirements

__all__ = ["judge_files", "judge_frames", "requirements"]

__getattr__ = lazy_page(__name__, __file__)
