"""The report of a run as one self-contained HTML page, and the comparison of planners."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._compare import compare_planners
    from ._page import Table
    from ._write import write_report

__getattr__ = lazy_page(__name__, __file__)
