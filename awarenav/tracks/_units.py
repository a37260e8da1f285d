"""A check of the units of recorded people: times in seconds, places in metres.

People walk at about 1.3 m/s. A recording whose people walk at 0.05 m/s has numbers of frames for
times, and one at 130 m/s has centimetres for places.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np

from perception.arrays import FloatArray
from tracking import TrackingError
from tracking.people import FASTEST_MPS

# Whoever walks two metres or more walks some of them faster than this.
_SLOWEST_MPS: Final = 0.3
_USUAL_MPS: Final = 1.3
# So many people who walk one metre are judged if nobody walks two.
_SHORT_WALKS: Final = 10
# A speed is measured over this distance, so that steps, noise and standing do not count.
_STRETCH_M: Final = 1.0
# The largest factor that each unit explains, of a time too long and of a place too large.
_OF_TIMES: Final = (
    (300.0, "numbers of frames"),
    (3e4, "milliseconds"),
    (3e7, "microseconds"),
    (math.inf, "nanoseconds"),
)
_OF_PLACES: Final = ((30.0, ""), (300.0, "centimetres"), (math.inf, "millimetres"))


def refuse_other_units(
    source: str,
    paths: Iterable[tuple[FloatArray, FloatArray]],
    error: type[ValueError] = TrackingError,
) -> None:
    """Refuse recorded people who move as people do only in other units.

    People who walk less than two metres are not judged, unless nobody walks farther and ten or
    more walk one metre, as in a narrow view.

    Args:
        source: name of the recording in the message.
        paths: times (N,) that do not decrease and places (N, 2) of each person.
        error: class of the error.

    Raises:
        TrackingError: or ``error``: half of the metres that the people cover are faster than
            12 m/s, or nine in ten slower than 0.3 m/s. The message names the likely unit.
    """
    speeds: list[float] = []
    short: list[float] = []
    for times_s, places_m in paths:
        found = list(_stretch_speeds_mps(times_s.tolist(), places_m.tolist()))
        (speeds if len(found) > 1 else short).extend(found)
    if not speeds and len(short) >= _SHORT_WALKS:
        speeds = short
    if not speeds:
        return
    usual, fast = np.quantile(speeds, [0.5, 0.9]).tolist()
    if usual > FASTEST_MPS:
        unit = next(unit for most, unit in _OF_PLACES if usual < most * _USUAL_MPS)
        raise error(
            f"{source}: people move at {usual:.0f} m/s, and nobody does at more than "
            f"{FASTEST_MPS:g} m/s; times are in seconds, places in metres"
            + (f": these look like {unit}" if unit else ", and an id is one person")
        )
    if fast < _SLOWEST_MPS:
        unit = next(unit for most, unit in _OF_TIMES if most * fast > _USUAL_MPS)
        raise error(
            f"{source}: people walk at {fast:.2g} m/s, and nobody does at less than "
            f"{_SLOWEST_MPS:g} m/s; times are in seconds, places in metres: the times look like "
            f"{unit}"
        )


def _stretch_speeds_mps(times_s: list[float], places_m: list[list[float]]) -> Iterator[float]:
    """Yield the speed of each metre that a person covers, without the standing before it."""
    start = 0
    for end, place in enumerate(places_m):
        if math.dist(place, places_m[start]) < _STRETCH_M:
            continue
        last = end - 1
        while math.dist(place, places_m[last]) < _STRETCH_M:
            last -= 1
        start = end
        if times_s[end] > times_s[last]:
            yield math.dist(place, places_m[last]) / (times_s[end] - times_s[last])
