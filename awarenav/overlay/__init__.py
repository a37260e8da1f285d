"""The overlay of pictures: each person's gaze, α, distance and skeleton."""

from __future__ import annotations

from ._labels import OverlaidPerson
from ._people import draw_people

__all__ = ["OverlaidPerson", "draw_people"]
