"""The frontier: time lost over step-out impacts, with and without awareness."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._frontier import TODAY, sensors_of_today

__all__ = ["TODAY", "sensors_of_today"]

__getattr__ = lazy_page(__name__, __file__)
