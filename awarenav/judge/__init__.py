"""Estimates of people compared with the truth: ``awarenav judge``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._judge import JudgeConfig, judge_files
    from ._report import markdown_report, requirements

__all__ = [
    "JudgeConfig",
    "judge_files",
    "markdown_report",
    "requirements",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._judge": (
            "JudgeConfig",
            "judge_files",
        ),
        "._report": (
            "markdown_report",
            "requirements",
        ),
    },
)
