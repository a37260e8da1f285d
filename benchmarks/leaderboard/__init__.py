"""The leaderboard: policies, sensors and planners over all scenarios, from committed results."""

from __future__ import annotations

from ._measure import measure, read_results
from ._page import leaderboard_page, ranked
from ._rows import PAGE, RESULTS, Board, Row

__all__ = [
    "PAGE",
    "RESULTS",
    "Board",
    "Row",
    "leaderboard_page",
    "measure",
    "ranked",
    "read_results",
]
