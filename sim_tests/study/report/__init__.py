"""The report of a run as one self-contained HTML page: ``awarenav report``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._text import number, percent
    from ._write import write_report

__all__ = ["number", "percent", "write_report"]

__getattr__ = lazy_names(
    __name__,
    {
        "._text": (
            "number",
            "percent",
        ),
        "._write": ("write_report",),
    },
)
