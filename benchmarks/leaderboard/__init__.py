"""The leaderboard: policies, sensors and planners over all scenarios, from committed results."""

from __future__ import annotations

from ._measure import differences, measure, read_results, remeasured
from ._page import leaderboard_page, ranked, write_leaderboard
from ._rows import PAGE, RESULTS, Board, Row

__all__ = [
    "PAGE",
    "RESULTS",
    "Board",
    "Row",
    "differences",
    "leaderboard_page",
    "measure",
    "ranked",
    "read_results",
    "remeasured",
    "write_leaderboard",
]
