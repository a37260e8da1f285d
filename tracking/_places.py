"""The latest measured places of people, as a column of the table and as plain values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from perception.arrays import FloatArray

#: Places that are kept of a person: a second of two scanners at 40 Hz, with some to spare.
SLOTS: Final = 96
#: Numbers of a place: stamp (−∞ for an empty slot), x, y, index of the sensor.
NUMBERS: Final = 4

#: A place as plain values.
PlainPlace = tuple[float, float, float, int]


def slots_of(window_s: float | None) -> int:
    """Return how many places are kept of each person."""
    return 0 if window_s is None else SLOTS


def no_places(count: int, window_s: float | None) -> FloatArray:
    """Return the places (count, K, 4) of new tracks."""
    places = np.zeros((count, slots_of(window_s), NUMBERS))
    places[:, :, 0] = -np.inf
    return places


def plain_places(places: FloatArray) -> list[list[PlainPlace]]:
    """Return the places (N, K, 4) as plain values, without empty slots."""
    return [
        [(*place[:3], int(place[3])) for place in each[np.isfinite(each[:, 0])].tolist()]
        for each in places
    ]


def places_of(
    plain: Sequence[Sequence[PlainPlace]], count: int, window_s: float | None
) -> FloatArray:
    """Return the places (count, K, 4) that :func:`plain_places` made plain."""
    places = no_places(count, window_s)
    for row, each in enumerate(plain):
        if each and window_s is not None:
            places[row, -len(each) :] = each
    return places
