"""Everybody once, who shows in several views of one instant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from .._observation import PersonObservation
from ..errors import PerceptionError
from ._views import FlatView

# Two sightings are of one person up to here: χ² of two degrees of freedom, exceeded once in a
# thousand times, on the plane across the camera's y axis, with what cut-off bodies add.
_SAME_CHI2: Final = 13.8
_CUT_OFF_STD_M: Final = 0.1
_SAME_WITHIN_M: Final = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class SeenInView:
    """A person seen, and in which view.

    Attributes:
        observation: in the camera's frame; its box is in the view's pixels.
        view: index of the view.
        row: index among the view's observations.
    """

    observation: PersonObservation
    view: int
    row: int


def merge_views(
    views: Sequence[FlatView], seen: Sequence[Sequence[PersonObservation]]
) -> tuple[SeenInView, ...]:
    """Everybody once: observations of several views of one instant, in the camera's frame.

    A person in the overlap of two views shows in both. Two observations are of one person when they
    come from different views and lie within 1 m of each other and no further apart than their
    covariances explain; the nearest pairs are taken first, and each observation pairs with one of
    every other view at most. Of a pair the one nearer to the axis of its view stays, which cuts
    less off the body. Nobody is invented or lost: a person seen in one view stays, whatever stands
    near in the same view.

    Args:
        views: V of one camera.
        seen: what each of them shows, in its own optical frame.

    Raises:
        PerceptionError: for other than one list of observations a view.
    """
    if len(seen) != len(views):
        raise PerceptionError(
            f"seen must hold one list of observations a view ({len(views)}), got {len(seen)}"
        )
    entries = [
        SeenInView(view.in_camera(observation), number, row)
        for number, (view, rows) in enumerate(zip(views, seen, strict=True))
        for row, observation in enumerate(rows)
    ]
    pairs = sorted(
        (distance_m, one, other)
        for one, first in enumerate(entries)
        for other in range(one + 1, len(entries))
        if first.view != entries[other].view
        and (distance_m := _apart_m(first.observation, entries[other].observation)) is not None
    )
    gone: set[int] = set()
    paired: set[tuple[int, int]] = set()
    for _, one, other in pairs:
        first, second = entries[one], entries[other]
        taken = (one, second.view) in paired or (other, first.view) in paired
        if taken or one in gone or other in gone:
            continue
        paired |= {(one, second.view), (other, first.view)}
        off_rad = [_off_axis_rad(seen[entry.view][entry.row]) for entry in (first, second)]
        gone.add(other if off_rad[0] <= off_rad[1] else one)
    return tuple(entry for index, entry in enumerate(entries) if index not in gone)


def _apart_m(first: PersonObservation, second: PersonObservation) -> float | None:
    """How far two observations lie apart across the vertical; None for two people."""
    away = (second.position_camera_m - first.position_camera_m)[[0, 2]]
    distance_m = float(np.hypot(*away))
    if distance_m > _SAME_WITHIN_M:
        return None
    both = first.position_covariance_m2 + second.position_covariance_m2
    spread = both[np.ix_([0, 2], [0, 2])] + _CUT_OFF_STD_M**2 * np.eye(2)
    chi2 = float(away @ np.linalg.solve(spread, away))
    return distance_m if chi2 <= _SAME_CHI2 else None


def _off_axis_rad(observation: PersonObservation) -> float:
    """Angle from the axis of the view that the observation is in."""
    x, _, z = observation.position_camera_m.tolist()
    return abs(math.atan2(x, z))
