"""The report of a run as one self-contained HTML page: ``awarenav report``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

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

__getattr__ = lazy_page(__name__, __file__)
