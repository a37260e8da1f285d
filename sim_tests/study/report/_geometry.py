"""Places of labels and marks in plots: labels do not overlap, and no mark covers another.

Plots are as wide as the page allows. All is laid out for the narrowest, on a phone of 390 px; wider
plots have more room.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

#: Font of labels in plots, as the style sheet sets it.
FONT_PX: Final = 11.5
# Width of a digit and gap between two labels, as shares of the font's size.
_DIGIT_EM: Final = 0.62
_GAP_EM: Final = 0.6
#: Inner size of the plot of episodes and length of an interval's axis on a phone.
PLOT_PX: Final = (300.0, 300.0)
TRACK_PX: Final = 105.0
# A mark is moved at most so many steps along the upright axis, and aside.
_MOST_UP: Final = 40
_MOST_ASIDE: Final = 4
# One step aside costs as much as so many up or down: across is the margin, which matters more.
_ASIDE_COST: Final = 3


def label_px(text: str) -> float:
    """Return the width of a label in pixels."""
    return FONT_PX * _DIGIT_EM * len(text)


def labels_fit(labels: Iterable[tuple[float, str]], length_px: float) -> bool:
    """Return whether labels beside each other do not overlap.

    Args:
        labels: places of their middles in per cent, ascending, and texts.
        length_px: length of the axis.
    """
    return all(
        0.01 * length_px * (after - before)
        >= 0.5 * (label_px(text) + label_px(other)) + _GAP_EM * FONT_PX
        for (before, text), (after, other) in itertools.pairwise(labels)
    )


@dataclass(frozen=True, slots=True)
class Region:
    """The part of a plot in which a mark may be moved, in per cent.

    Attributes:
        left: smallest x.
        right: largest x.
        top: smallest y.
        bottom: largest y.
    """

    left: float
    right: float
    top: float
    bottom: float

    def holds(self, x: float, y: float) -> bool:
        """Return whether a place is inside."""
        return self.left <= x <= self.right and self.top <= y <= self.bottom


def spread(
    places: Sequence[tuple[float, float, Region]], apart: float
) -> tuple[list[tuple[float, float]], int]:
    """Move marks that would cover each other apart, up or down rather than aside.

    Marks stay in their order: an earlier mark keeps its place, and a later one takes the nearest
    that is free. The same marks give the same places.

    Args:
        places: x and y of the marks, and the region in which each may be moved, in per cent.
        apart: smallest distance between two marks along x or along y, in per cent.

    Returns:
        The new places, and the number of marks that found none and lie on others.
    """
    offsets = sorted(
        itertools.product(range(-_MOST_ASIDE, _MOST_ASIDE + 1), range(-_MOST_UP, _MOST_UP + 1)),
        key=lambda offset: (_ASIDE_COST * abs(offset[0]) + abs(offset[1]), offset),
    )
    taken: dict[tuple[int, int], list[tuple[float, float]]] = {}
    full: set[tuple[float, float]] = set()
    found: list[tuple[float, float]] = []
    covered = 0
    for x, y, region in places:
        free = None
        for aside, up in offsets if (x, y) not in full else ():
            place = round(x + apart * aside, 2), round(y + apart * up, 2)
            if region.holds(*place) and _is_free(place, taken, apart):
                free = place
                break
        if free is None:
            full.add((x, y))
            covered += 1
            found.append((x, y))
        else:
            taken.setdefault(_cell(free, apart), []).append(free)
            found.append(free)
    return found, covered


def _cell(place: tuple[float, float], apart: float) -> tuple[int, int]:
    return math.floor(place[0] / apart), math.floor(place[1] / apart)


def _is_free(
    place: tuple[float, float],
    taken: dict[tuple[int, int], list[tuple[float, float]]],
    apart: float,
) -> bool:
    """Return whether no mark is nearer than ``apart`` along both axes."""
    column, row = _cell(place, apart)
    least = apart - 0.02  # places are rounded to two decimals
    return not any(
        abs(x - place[0]) < least and abs(y - place[1]) < least
        for i in (column - 1, column, column + 1)
        for j in (row - 1, row, row + 1)
        for x, y in taken.get((i, j), ())
    )
