"""The frontier: time lost over step-out impacts, with and without awareness."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._family import SPEEDS_MPS, TODAY, Member, family, sensors_of_today
    from ._frontier import Frontier, Point, Worth, frontier_of
    from ._plot import draw_frontier
    from ._text import frontier_text, sentences

__all__ = [
    "SPEEDS_MPS",
    "TODAY",
    "Frontier",
    "Member",
    "Point",
    "Worth",
    "draw_frontier",
    "family",
    "frontier_of",
    "frontier_text",
    "sensors_of_today",
    "sentences",
]

__getattr__ = lazy_page(__name__, __file__)
