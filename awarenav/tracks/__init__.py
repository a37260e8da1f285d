"""Tracks of the people in a file of estimates, drawn and tabulated: ``awarenav tracks``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from perception.lazy import lazy_page

if TYPE_CHECKING:
    from ._people_table import person_id, read_people_table

__all__ = ["person_id", "read_people_table"]

__getattr__ = lazy_page(__name__, __file__)
