"""One report of each person from the scans of several scanners."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np

from ..arrays import FloatArray, finite_number
from ._candidate import CandidateKind, PersonCandidate

# Candidates of two scanners this near are one person; each scanner sees another side of the legs.
_SAME_M: Final = 0.45
# A trolley this near to somebody's legs is that person's.
_TROLLEY_M: Final = 1.2


def merge_candidates(
    groups: Iterable[Iterable[PersonCandidate]], *, same_within_m: float = _SAME_M
) -> tuple[PersonCandidate, ...]:
    """Return the people in scans of several scanners, each person once, most certain first.

    A person whom two scanners see gets the weighted mean of both places, and the covariance of the
    better one: what the scans get wrong about a body, they get wrong together. Candidates of one
    scan are never merged.

    Args:
        groups: candidates of each scanner's last scan; their stamps should be near each other.
        same_within_m: candidates of two scanners this near to each other are one person.

    Raises:
        PerceptionError: for a distance that is not positive.
    """
    near_m = finite_number("same_within_m", same_within_m, minimum=0.0, exclusive_minimum=True)
    tagged = [(each, number) for number, group in enumerate(groups) for each in group]
    tagged.sort(key=lambda pair: (pair[0].kind == "trolley", -pair[0].score))
    merged: list[PersonCandidate] = []
    places: list[list[float]] = []
    sources: list[set[int]] = []
    for candidate, number in tagged:
        place = candidate.position_odom_m.tolist()
        trolley = candidate.kind == "trolley"
        best, nearest = -1, _TROLLEY_M if trolley else near_m
        for row, other in enumerate(places):
            away = math.dist(other, place)
            if number not in sources[row] and away < nearest:
                best, nearest = row, away
        if best < 0:
            merged.append(candidate)
            places.append(place)
            sources.append({number})
        else:
            sources[best].add(number)
            if not trolley:
                merged[best] = _fused(merged[best], candidate)
                places[best] = merged[best].position_odom_m.tolist()
    return tuple(merged)


def _fused(one: PersonCandidate, other: PersonCandidate) -> PersonCandidate:
    weights = [_inverse(each.covariance_m2) for each in (one, other)]
    (a, b), (c, d) = (weights[0] + weights[1]).tolist()
    x, y = (weights[0] @ one.position_odom_m + weights[1] @ other.position_odom_m).tolist()
    scale = 1.0 / (a * d - b * c)
    mean = scale * (d * x - b * y), scale * (a * y - c * x)
    sizes = [float(each.covariance_m2[0, 0] + each.covariance_m2[1, 1]) for each in (one, other)]
    better = one if sizes[0] <= sizes[1] else other
    kind: CandidateKind = "two_legs" if "two_legs" in (one.kind, other.kind) else one.kind
    return replace(
        one,
        stamp_s=max(one.stamp_s, other.stamp_s),
        position_odom_m=np.array(mean),
        covariance_m2=better.covariance_m2,
        kind=kind,
    )


def _inverse(matrix: FloatArray) -> FloatArray:
    (a, b), (c, d) = matrix.tolist()
    return np.asarray(np.array([(d, -b), (-c, a)]) / (a * d - b * c))
