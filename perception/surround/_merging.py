"""Merging of observations from several views: each person once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from .._observation import PersonObservation
from ..errors import PerceptionError
from ._views import FlatView

# Two observations are of the same person up to this χ² in the plane across the camera's y axis (two
# degrees of freedom, exceeded by chance in 0.1 % of cases), and up to this distance.
_SAME_CHI2: Final = 13.8
_SAME_WITHIN_M: Final = 1.0
# Standard deviation to add, because the border of a view cuts bodies off.
_CUT_OFF_STD_M: Final = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class SeenInView:
    """An observation and the view that it comes from.

    Attributes:
        observation: the observation in the camera frame; its box is in pixels of the view.
        view: index of the view.
        row: index among the observations of the view.
    """

    observation: PersonObservation
    view: int
    row: int


def merge_views(
    views: Sequence[FlatView], seen: Sequence[Sequence[PersonObservation]]
) -> tuple[SeenInView, ...]:
    """Merge the observations of several views of one instant, so that each person occurs once.

    A person in the overlap of two views appears in both. Two observations are of the same person if
    they come from different views, lie within 1 m of each other, and are no farther apart than
    their covariances explain. The nearest pairs are formed first, and an observation pairs with at
    most one of each other view. Of a pair, the observation nearer to the axis of its view is kept,
    because there the border cuts off less of the body. Observations of one view are never merged
    with each other.

    Args:
        views: V views of one camera.
        seen: observations of each view, in the view's optical frame.

    Returns:
        The merged observations in the camera frame.

    Raises:
        PerceptionError: if there is not one list of observations per view.
    """
    if len(seen) != len(views):
        raise PerceptionError(
            f"seen must hold one list of observations per view ({len(views)}), got {len(seen)}"
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
        and (distance_m := _distance_if_same_m(first.observation, entries[other].observation))
        is not None
    )
    dropped: set[int] = set()
    paired: set[tuple[int, int]] = set()
    for _, one, other in pairs:
        first, second = entries[one], entries[other]
        taken = (one, second.view) in paired or (other, first.view) in paired
        if taken or one in dropped or other in dropped:
            continue
        paired |= {(one, second.view), (other, first.view)}
        off_rad = [_off_axis_rad(seen[entry.view][entry.row]) for entry in (first, second)]
        dropped.add(other if off_rad[0] <= off_rad[1] else one)
    return tuple(entry for index, entry in enumerate(entries) if index not in dropped)


def _distance_if_same_m(first: PersonObservation, second: PersonObservation) -> float | None:
    """Return the horizontal distance of two observations; None if they are of two people."""
    difference = (second.position_camera_m - first.position_camera_m)[[0, 2]]
    distance_m = float(np.hypot(*difference))
    if distance_m > _SAME_WITHIN_M:
        return None
    both = first.position_covariance_m2 + second.position_covariance_m2
    spread = both[np.ix_([0, 2], [0, 2])] + _CUT_OFF_STD_M**2 * np.eye(2)
    chi2 = float(difference @ np.linalg.solve(spread, difference))
    return distance_m if chi2 <= _SAME_CHI2 else None


def _off_axis_rad(observation: PersonObservation) -> float:
    """Return the horizontal angle between the axis of the view and the observation."""
    x, _, z = observation.position_camera_m.tolist()
    return abs(math.atan2(x, z))
