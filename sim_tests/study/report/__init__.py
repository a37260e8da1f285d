"""The report of a run as one self-contained HTML page: ``awarenav report``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from awarenav.lazy import lazy_names

if TYPE_CHECKING:
    from ._page import write_page
    from ._panel import Panel, panel
    from ._text import NOTHING, count, number, percent, plural
    from ._write import write_report

__all__ = [
    "NOTHING",
    "Panel",
    "count",
    "number",
    "panel",
    "percent",
    "plural",
    "write_page",
    "write_report",
]

__getattr__ = lazy_names(
    __name__,
    {
        "._page": ("write_page",),
        "._panel": (
            "Panel",
            "panel",
        ),
        "._text": (
            "NOTHING",
            "count",
            "number",
            "percent",
            "plural",
        ),
        "._write": ("write_report",),
    },
)
